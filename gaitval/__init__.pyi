from gaitval.interface.bodies import scale as scale
from gaitval.interface.limits import limits as limits
from gaitval.interface.recordings import read_recording as read_recording
from gaitval.interface.subjects import load_subject as load_subject
from gaitval.interface.walks import compare as compare
from gaitval.interface.walks import load_policy as load_policy
from gaitval.interface.walks import rollout as rollout

__version__: str
