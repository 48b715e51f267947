"""Figures of logs and trainings, as files to look at."""

from gaitshift.plots.contacts import contact_diagram as contact_diagram
from gaitshift.plots.demo import demo_figure as demo_figure
from gaitshift.plots.hildebrand import hildebrand_diagram as hildebrand_diagram
from gaitshift.plots.palette import gait_colours as gait_colours
from gaitshift.plots.time_to_gait import time_to_gait_figure as time_to_gait_figure
from gaitshift.plots.training import training_curves as training_curves
