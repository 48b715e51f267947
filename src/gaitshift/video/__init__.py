"""Logs as videos."""

from gaitshift.video.canvas import VideoUnavailable as VideoUnavailable
from gaitshift.video.render import render as render
from gaitshift.video.sheet import contact_sheet as contact_sheet
