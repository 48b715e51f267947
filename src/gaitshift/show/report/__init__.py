"""One self-contained page of a run, a training or a study, that opens from disk."""

from gaitshift.show.report.log_page import MOST_VIDEO as MOST_VIDEO
from gaitshift.show.report.log_page import write_report as write_report
from gaitshift.show.report.training_page import TrainingFigures as TrainingFigures
from gaitshift.show.report.training_page import write_training_report as write_training_report
