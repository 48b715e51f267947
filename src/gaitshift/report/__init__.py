"""One self-contained page of a run: a robot to turn around, its signals, and what it came to."""

from gaitshift.report.page import MOST_VIDEO as MOST_VIDEO
from gaitshift.report.page import write_report as write_report
