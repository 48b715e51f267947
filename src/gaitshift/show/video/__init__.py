"""Logs as videos."""

from gaitshift.show.video.canvas import VideoUnavailable as VideoUnavailable
from gaitshift.show.video.render import render as render
