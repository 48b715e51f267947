"""Logs as videos."""

from gaitshift.show.video.canvas import VideoUnavailable as VideoUnavailable
from gaitshift.show.video.render import render as render
from gaitshift.show.video.sheet import contact_sheet as contact_sheet
