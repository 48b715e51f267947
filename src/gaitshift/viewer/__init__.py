"""A page in the browser on which robots walk: live, or from a log."""

from gaitshift.viewer.live import LiveConfig as LiveConfig
from gaitshift.viewer.live import LiveRun as LiveRun
from gaitshift.viewer.live_page import LivePage as LivePage
from gaitshift.viewer.replay_page import ReplayPage as ReplayPage
from gaitshift.viewer.server import close as close
from gaitshift.viewer.server import serve as serve
