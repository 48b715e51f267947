"""A page in the browser on which robots walk: live, or from a log."""

from gaitshift.show.viewer.live import LiveConfig as LiveConfig
from gaitshift.show.viewer.live import LiveRun as LiveRun
from gaitshift.show.viewer.live_page import LivePage as LivePage
from gaitshift.show.viewer.replay_page import ReplayPage as ReplayPage
from gaitshift.show.viewer.server import address_of as address_of
from gaitshift.show.viewer.server import close as close
from gaitshift.show.viewer.server import serve as serve
from gaitshift.show.viewer.training import Training as Training
