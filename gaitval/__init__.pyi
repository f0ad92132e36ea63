from gaitval.interface.balance import perturb as perturb
from gaitval.interface.bodies import scale as scale
from gaitval.interface.changes import against_healthy as against_healthy
from gaitval.interface.changes import change as change
from gaitval.interface.limits import limits as limits
from gaitval.interface.metabolic import metabolic_cost as metabolic_cost
from gaitval.interface.motions import inverse_dynamics as inverse_dynamics
from gaitval.interface.motions import inverse_kinematics as inverse_kinematics
from gaitval.interface.muscle_forces import muscles as muscles
from gaitval.interface.recordings import read_recording as read_recording
from gaitval.interface.references import reference_motion as reference_motion
from gaitval.interface.sessions import import_session as import_session
from gaitval.interface.studies import run_study as run_study
from gaitval.interface.studies import write_report as write_report
from gaitval.interface.subjects import load_subject as load_subject
from gaitval.interface.walks import compare as compare
from gaitval.interface.walks import load_policy as load_policy
from gaitval.interface.walks import rollout as rollout

__version__: str
