"""Figures of logs and trainings as files."""

from gaitshift.show.plots.demo import demo_figure as demo_figure
from gaitshift.show.plots.hildebrand import hildebrand_diagram as hildebrand_diagram
from gaitshift.show.plots.rows import contact_diagram as contact_diagram
from gaitshift.show.plots.style import gait_colours as gait_colours
from gaitshift.show.plots.time_to_gait import time_to_gait_figure as time_to_gait_figure
from gaitshift.show.plots.training import training_curves as training_curves
