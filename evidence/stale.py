"""Rows of `reports/evidence` whose code has changed since they were measured.

    python -m evidence stale             names them, and why; exit 1 if there are any
    python -m evidence stale --retire    moves them to reports/evidence/past

Each file that makes rows declares in `MEASURES` what its rows depend on, by a pattern of their
`what`: `code`, `data`, `results`, and how many changed statements of the code are `allowed`, with
the reason `why`. None are, if it does not say.

`code` names files of the project by patterns. `path.py:name,name` is these definitions only, and
`@group` a group of `evidence/sources.py`. It is compared statement by statement between the row's
commit and the files of today, by syntax tree, so that comments, docstrings and layout do not count;
nor do imports, for what they bring in is declared itself; nor does the command that a row names. A
definition that moved from a declared file to another has not changed. A file that git sees as moved
is compared with what it was under its old name. Any change of the content of a file of `data` makes
a row stale; comments of TOML and CSV are no content. `results` hold what an earlier run measured: a
row that was read from them carries the oldest commit that last changed one of them, and is stale
once that is another.

The file itself belongs to its rows too (but for its `MEASURES`), or those of its definitions that
`code` names.

A change of code that leaves all numbers as they were, and the tests that show it, is declared in
`EQUAL`: for rows that were measured before it, its statements do not count.

Rows that are no longer of today's code, and would take hours to measure anew, are kept in
`reports/evidence/past`: they say what was measured once, and when; nothing is claimed of today.
"""

import argparse
import ast
import copy
import fnmatch
import hashlib
import subprocess
import tomllib
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from difflib import SequenceMatcher
from functools import cache
from typing import Final, NamedTuple

from . import rows as evidence
from .registry import source_of
from .sources import ROOT, Dependence, dependence, targets

PAST: Final = evidence.FOLDER / "past"
MOVED: Final = 40
"""%, how much of a file must be as before for git to see it as moved; all of it is compared."""
COMMANDS: Final = {"COMMAND", "command", "_command", "about"}
"""What files called the command of a row while they gave it to the row themselves."""
_BODIES: Final = ("body", "orelse", "finalbody", "handlers", "cases")


class Equal(NamedTuple):
    """A change after which code gives the same numbers, bit for bit.

    Attributes
    ----------
    before, after : the commits on either side of it.
    code : patterns of the files that it changed so.
    why : how that is known.
    """

    before: str
    after: str
    code: tuple[str, ...]
    why: str


EQUAL: Final = (
    Equal(
        "32ee7420d4",
        "213e4f40e7",
        (
            *("gaitval/artefacts.py", "gaitval/compiled.py", "gaitval/lanes.py"),
            *("gaitval/identification/*.py", "gaitval/metrics/push_recovery.py"),
            *("gaitval/model/tree.py", "gaitval/policy/environment.py"),
            *("gaitval/policy/judgement.py", "gaitval/policy/observation.py"),
            *("gaitval/policy/rollouts.py", "gaitval/policy/storage.py"),
            *("gaitval/policy/walking_group.py", "gaitval/reference/*.py"),
            *("gaitval/simulation/walker.py", "gaitval/study/run.py", "gaitval/study/sources.py"),
            "tests/robustness/planted.toml",
        ),
        "observation and fall of eight walkers are computed in lanes, as alone: "
        "tests/policy/test_rollouts.py; metrics.json of a study was equal before and after; the "
        "search of a body moved to a wing; fits begin elsewhere only where the study's stages say",
    ),
    Equal(
        "19950ddc95",
        "dc2d394352",
        (
            "gaitval/model/tree.py",
            *("gaitval/policy/observation.py", "gaitval/study/sources.py"),
            *("gaitval/identification/*.py", "gaitval/study/estimate_stage.py"),
        ),
        "a function that only a test called is gone, and what was written twice is written once: "
        "tests/bodies, tests/identification, tests/estimate, tests/policy, tests/study",
    ),
    Equal(
        "3f93ded9cf",
        "b2287542a5",
        (
            *("gaitval/gait/foot_forces.py", "gaitval/gait/motion_check?.py"),
            *("gaitval/identification/begin.py", "gaitval/identification/body_fit.py"),
            *("gaitval/memory.py", "gaitval/reporting/page.py"),
            *("gaitval/mocap/*.py", "gaitval/policy/observation.py", "gaitval/policy/storage.py"),
            *("gaitval/scaling/*.py", "gaitval/study/run.py", "gaitval/apps/cohort/*.py"),
            *("gaitval/mocap/vicon_csv.py", "gaitval/scaling/markers/files.py"),
            "gaitval/measurement/estimate.py",
        ),
        "files that could be read are read as before, others are no longer refused (tests/mocap, "
        "tests/formats, tests/scaling, tests/measurement; the recordings of 13 sources have the "
        "same numbers); observations are normalised compiled, bit for bit as before "
        "(tests/policy); studies of a cohort are forked, which changes nothing: its kills and its "
        "equality with other studies were measured again; a fit begins elsewhere only where it is "
        "given a reference",
    ),
    Equal(
        "ec95f87c12",
        "d121acf504",
        (
            *("gaitval/terminal/app.py", "gaitval/gait/force_check?.py", "gaitval/memory.py"),
            *("gaitval/metrics/curve_statistics.py", "gaitval/metrics/push_recovery.py"),
            *("gaitval/policy/*.py", "gaitval/reference/motion.py", "gaitval/reporting/*.py"),
            *("gaitval/scaling/scaling.py", "gaitval/session/*.py", "gaitval/study/sources.py"),
            *("gaitval/simulation/mujoco_body.py", "gaitval/apps/cohort/*.py"),
            *("gaitval/apps/devices/*.py", "evidence/report/curve_statistics.py"),
        ),
        "walks, pushes and metrics.json of the ten were equal before and after; a plate is read "
        "otherwise only with --plate-axis; messages; tests/metrics/test_curve_statistics.py",
    ),
    Equal(
        "db7806e740",
        "b521cee121",
        (
            *("gaitval/gait/force_check?.py", "gaitval/gait/mean_curves.py"),
            "gaitval/identification/*.py",
            *("gaitval/mocap/c3d_plates.py", "gaitval/scaling/scaling.py"),
            *("gaitval/session/*.py", "gaitval/study/stage.py"),
            "gaitval/simulation/mujoco_body.py",
            *("gaitval/apps/export/*.py", "gaitval/scaling/markers/*.py"),
            "gaitval/apps/virtual/*.py",
        ),
        "plates are read otherwise only where the load was beside them or a channel jumped by 16 "
        "bits, and a force only where its fit was refused (tests/mocap, tests/gait; the recordings "
        "of 13 sources again); the order of two writes; messages; a module moved",
    ),
    Equal(
        "cd9bfde675",
        "ef7d6c13dc",
        (
            *("gaitval/configuration.py", "gaitval/datasets/plausible.py"),
            *("gaitval/metrics/push_recovery.py", "gaitval/metrics/policy_comparison.py"),
            *("gaitval/metrics/validation.py", "gaitval/metrics/verdict_rows.py"),
            *("gaitval/metrics/walk_results.py", "gaitval/mocap/*.py", "gaitval/scaling/*.py"),
            *("gaitval/policy/training.py", "gaitval/session/*.py", "gaitval/study/stages.py"),
            *("gaitval/mocap/*.py", "gaitval/scaling/markers/*.py"),
        ),
        "plates without a fault are read as before, and who stands flat and walks steadily is "
        "scaled as before (tests/datasets/test_wbds.py builds the ten again; the recordings of 13 "
        "sources again); nobody of the ten is lighter than 46 kg; a policy is known by the scaled "
        "body, another than the trained one only for legs that differ; modules moved; messages",
    ),
    Equal(
        "64673b4a57",
        "e4d29202d8",
        (
            *("gaitval/metrics/curve_statistics.py", "gaitval/metrics/learning_gain.py"),
            *("gaitval/metrics/policy_comparison.py", "gaitval/metrics/push_recovery.py"),
            *("gaitval/metrics/repeats.py", "gaitval/metrics/rollouts.py", "gaitval/policy/*.py"),
            *("gaitval/reference/dynamic_fit.py", "gaitval/reporting/*.py", "gaitval/study/*.py"),
        ),
        "metrics.json and pushes of S05 were equal before and after, but for the walk of the "
        "scaled body, which is in another engine and differs in the sixth digit, and the engine "
        "that is named for the first start; trainings are kept and go on by other rules, which who "
        "is not trained does not meet; two rough cycles have no threshold",
    ),
    Equal(
        "685e1eee96",
        "079f07aa3c",
        ("gaitval/learning_control/*.py", "gaitval/reporting/*.py", "gaitval/study/*.py"),
        "walks of a correction are the same, and no longer kept on the way "
        "(tests/learning_control); a sentence of the report",
    ),
    Equal(
        "de55da07a8",
        "55cb5cc9a3",
        ("gaitval/scaling/joint_width.py",),
        "a message; the bodies of the ten were fitted again and are equal to the last digit "
        "(experiments/skin_width.py)",
    ),
    Equal(
        "0aa5e67e1e",
        "fa94ac4a03",
        (
            *("gaitval/mocap/c3d_plates.py", "gaitval/mocap/cleaning.py"),
            *("gaitval/mocap/exchanges.py", "gaitval/scaling/landmarks.py", "gaitval/session/*.py"),
        ),
        "halves of a session were imported and walked again and are equal to the last digit; what "
        "is new is for files that were refused, or whose plate was left out (tests/mocap, "
        "tests/session)",
    ),
    Equal(
        "b9e819ab74",
        "50309ab51f",
        ("gaitval/cli/markers.py",),
        "what the command prints below the guesses; the drafts are as before (tests/markers)",
    ),
    Equal(
        "55e1bc7582",
        "9714d2b530",
        (
            *("gaitval/gait/foot_forces.py", "gaitval/gait/plate_contacts.py"),
            *("gaitval/session/request.py", "gaitval/session/trial.py"),
        ),
        "a plate is divided only with --divide-plates (tests/gait, tests/measurement); a message",
    ),
    Equal(
        "b4ca47339b",
        "5be7c7ea4b",
        (
            *("gaitval/gait/foot_forces.py", "gaitval/gait/plate_contacts.py"),
            *("gaitval/prediction/unusua?.py", "gaitval/study/one_stage.py"),
            *("gaitval/study/run.py", "gaitval/study/stage.py", "gaitval/study/stages.py"),
            *("gaitval/model/devices/device.py", "gaitval/apps/devices/hinge_step.py"),
            *("gaitval/apps/devices/walking.py", "gaitval/scaling/markers/files.py"),
            *("gaitval/gait/divided.py", "gaitval/measurement/standing.py"),
            *("gaitval/apps/patients/estimates.py", "gaitval/apps/patients/passive_foot.py"),
            "gaitval/apps/patients/records.py",
        ),
        "the wrench of a plate is put together once (tests/gait; the figures of a divided one are "
        "equal to the last digit); all files of a study of S05 but times and pages are equal to "
        "the last bit, and times were measured again; no shipped device has a socket, and one "
        "without play is a strap to the last bit (tests/devices); names that can be printed are "
        "written as before (tests/markers); no session of a row has --static-time; bodies, "
        "estimates and expected records of the 104 records of gps/ are equal to the last bit",
    ),
    Equal(
        "d460e14fcb",
        "34cbdfd76e",
        ("gaitval/mocap/exchanges.py",),
        "only for who has left markers to the right of their partners, which no row's person has",
    ),
    Equal(
        "2186ba8723",
        "58f20e8d55",
        (
            *("gaitval/datasets/plausible.py", "gaitval/prediction/unusua?.py"),
            *("gaitval/mocap/exchanges.py", "gaitval/mocap/recording.py"),
            *("gaitval/mocap/separate_forces.py", "gaitval/reporting/report.py"),
            *("gaitval/session/session.py", "gaitval/study/*.py"),
            *("gaitval/importing/batch_imports.py", "gaitval/apps/judge/command.py"),
            *("gaitval/measurement/correct.py", "gaitval/measurement/measured.py"),
            *("gaitval/measurement/standing.py", "gaitval/apps/patients/records.py"),
        ),
        "what was written twice is written once: curves of imports of the sample and of WBDS01 "
        "and everything of the 104 records of gps/ are equal to the last bit; tests/measurement, "
        "tests/mocap, tests/patients, tests/study",
    ),
    Equal(
        "677c0a5365",
        "5a926ab5fb",
        (
            *("gaitval/configuration.py", "gaitval/datasets/*.py", "gaitval/gait/record.py"),
            *("gaitval/interface/*.py", "gaitval/metrics/*.py", "gaitval/metrics/*.toml"),
            *("gaitval/mocap/recording.py", "gaitval/model/rotations.py", "gaitval/policy/*.py"),
            *("gaitval/reporting/*", "gaitval/session/*.py", "gaitval/apps/cohort/table.py"),
            *("gaitval/datasets/*.py", "gaitval/apps/export/*.py"),
            *("gaitval/mocap/*.py", "gaitval/apps/judge/judge_page.py"),
            *("gaitval/apps/patients/one_stride.py", "gaitval/apps/virtual/*.py"),
        ),
        "a study of S05 is equal to the last digit but foot progression, the score that it is part "
        "of, texts and the interval of falls; an import of WBDS01 but the angles of the feet, and "
        "the steps that it now has; rows of the 104 records' walks are measured again",
    ),
    Equal(
        "5a926ab5fb",
        "af7df6b6d0",
        ("gaitval/study/stages.py", "gaitval/interface/arguments.py"),
        "only the hash of the subject in metrics.json, of runs with a device or a trial held out",
    ),
    Equal(
        "af7df6b6d0",
        "5e5f28c507",
        (
            *("gaitval/gait/mean_curves.py", "gaitval/interface/*.py"),
            *("gaitval/session/subject.py", "gaitval/mocap/c3d_process.py"),
            *("gaitval/study/stages.py", "gaitval/datasets/*.py"),
            *("gaitval/datasets/locohub_subject.py", "gaitval/apps/virtual/person.py"),
        ),
        "a class that moved; no recording of a row has unsigned counts or negative offsets (18 "
        "looked at)",
    ),
    Equal(
        "2e1d914e8f",
        "d67f342451",
        (
            *("gaitval/prediction/speed.py", "gaitval/mocap/c3d_contents.py"),
            *("gaitval/artefacts.py", "gaitval/study/stage.py"),
            *("gaitval/scaling/markers/*.py", "gaitval/importing/batch_imports.py"),
        ),
        "predictions of the ten people at seven speeds, each trial held out, are equal bit by bit; "
        "no C3D file of 24 of shared/data and public repositories is refused; markers are drafted "
        "otherwise only where the names agree with the other side (tests/markers); a run is not "
        "written over another person's, and a batch keeps the whole words of a refusal",
    ),
    Equal(
        "3810a013cd",
        "6d43ef849c",
        ("gaitval/mocap/pressed_plates.py",),
        "a centre of pressure of 0 under 100 N and more is what it was before; no recording of a "
        "row has one, and C3D files have moments instead",
    ),
    Equal(
        "11901a5877",
        "70352b87e1",
        ("gaitval/mocap/c3d.py", "gaitval/mocap/c3d_contents.py"),
        "the header is read once: the same 24 C3D files are read, and the same rates are refused",
    ),
    Equal(
        "96c9e9ca02",
        "1fadef2d91",
        ("gaitval/reference/dynamic_fit.py", "gaitval/artefacts.py", "gaitval/study/run.py"),
        "a covariance that nobody reads is not computed, versions are read once: references, "
        "policies, walks and metrics.json of a study of S05 were equal before and after",
    ),
    Equal(
        "07b0160d67",
        "3f244f6c3a",
        (
            *("gaitval/datasets/subject.py", "gaitval/datasets/identity.py"),
            *("gaitval/prediction/unusua?.py", "gaitval/prediction/*.py"),
            *("gaitval/session/*.py", "gaitval/mocap/axes.py", "gaitval/mocap/recording.py"),
            "gaitval/gait/events.py",
        ),
        "other words beside the numbers: reference, walk, estimate and metrics.json of S07 from "
        "angles alone were equal before and after, byte for byte; so were both walks of halves of "
        "an imported session (reports/held_out/halves), with events as they had been again",
    ),
    Equal(
        "b5891b700b",
        "93419fdae9",
        (
            *("gaitval/model/urdf.py", "gaitval/compiled.py", "gaitval/study/sources.py"),
            *("gaitval/datasets/subject_file.py", "gaitval/interface/*.py"),
            "gaitval/model/devices/device_urdf.py",
        ),
        "files are kept elsewhere where a folder's name is evaluated or there is no home folder: "
        "model, reference, policy, walk and metrics.json of a study of S05 were equal",
    ),
    Equal(
        "93419fdae9",
        "3edeba2512",
        ("gaitval/gait/events.py",),
        "events are as they had been, statement for statement",
    ),
    Equal(
        "c0241df2d1",
        "cb5c4b3f6c",
        (
            *("gaitval/session/read.py", "gaitval/session/trial.py", "gaitval/importing/write.py"),
            *("gaitval/datasets/subject.py", "gaitval/study/stages.py"),
        ),
        "what writes OpenSim's files, warns of a recording and remarks on a person moved to wings: "
        "tables, motions, loads and moments of an import of the sample, and policy, reference, "
        "rollouts and metrics.json of a study of S05 were equal before and after",
    ),
    Equal(
        "bf106aa8de",
        "4f55b22b14",
        ("gaitval/policy/environment.py",),
        "a push of the default length leaves no rounding residue: policies of three rounds, walks, "
        "pushes and metrics.json of a training of S05 were equal before and after",
    ),
    Equal(
        "a427576373",
        "f71e63bc5a",
        ("gaitval/apps/devices/walking.py", "gaitval/scaling/*.py"),
        "what is logged of a hinge without strap or socket changed, and how hinges are led along a "
        "kept motion; walks of S05 and S07 with four devices were equal before and after. Bodies "
        "of who has a prosthesis, or masses that differ between the sides, and the unit of "
        "markers; reports/identification/skin.json of the ten was equal to the last bit",
    ),
    Equal(
        "f71e63bc5a",
        "b7f1df4361",
        ("tests/robustness/planted.toml",),
        "inDegrees is read elsewhere in mot.py; with the fault there, tests/mocap/test_mot.py "
        "fails as before",
    ),
    Equal(
        "b7f1df4361",
        "965f7c7053",
        ("evidence/held_out.py", "gaitval/terminal/display.py", "gaitval/mocap/units.py"),
        "inches and feet are read, which were refused: the walks of halves were made again, and "
        "their files are the same; a table stands elsewhere; names are printed as they are "
        "(tests/cli)",
    ),
    Equal(
        "965f7c7053",
        "f4c469082b",
        ("evidence/fit.py", "evidence/skill_interval.py"),
        "the interval of a skill is drawn elsewhere: fit kinematics and fit estimates give the "
        "same values",
    ),
    Equal(
        "f4c469082b",
        "9b3c8b7ba6",
        ("gaitval/mocap/units.py",),
        "the same units in one line: tests/mocap",
    ),
    Equal(
        "4e52078f34",
        "a34e8bf58a",
        (
            "docs/build/recording_tables.py",
            *("evidence/held_out.py", "evidence/sources.py"),
            "experiments/peer_results.py",
            "gaitval/apps/devices/page.py",
            *("gaitval/importing/batch_person.py", "gaitval/mocap/kistler_text.py"),
            "gaitval/apps/regression/stored.py",
            "gaitval/apps/judge/gait.py",
            "gaitval/measurement/bands.py",
            *("gaitval/learning_control/centring.py", "gaitval/study/predicted_study.py"),
            *(
                "gaitval/terminal/app.py",
                "gaitval/terminal/display.py",
                "gaitval/cli/recording.py",
                "gaitval/cli/study.py",
            ),
            *(
                "gaitval/datasets/identity.py",
                "gaitval/datasets/plausible.py",
                "gaitval/datasets/subject_file.py",
            ),
            "gaitval/gait/*.py",
            "gaitval/interface/walks.py",
            "gaitval/learning_control/correct.py",
            "gaitval/metrics/*.py",
            "gaitval/mocap/*.py",
            *("gaitval/prediction/known.py", "gaitval/prediction/normal_form.py"),
            "gaitval/reporting/*.py",
            "gaitval/scaling/*.py",
            "gaitval/session/*.py",
            *(
                "gaitval/study/run.py",
                "gaitval/study/stage.py",
                "gaitval/study/stages.py",
                "gaitval/study/watching.py",
            ),
        ),
        "records, sessions and pages are put together by fewer functions: metrics.json of the ten, "
        "rows of `anybody recordings` and the pages of ten imports are the same, byte for byte",
    ),
    Equal(
        "a34e8bf58a",
        "f4e3a7088f",
        (
            *("gaitval/checks/checks.py", "gaitval/checks/force_checks.py"),
            "gaitval/checks/marker_checks.py",
            *("gaitval/measurement/measured.py", "gaitval/measurement/said.py"),
            *("gaitval/gait/plate_offset.py", "gaitval/gait/zeroed_plate.py"),
            *("gaitval/mocap/cut_spikes.py", "gaitval/mocap/lost_frames.py"),
        ),
        "lost frames, exchanged corners and saturated plates are said, which are in none of these: "
        "the walks of halves were made again, and their files are the same",
    ),
    Equal(
        "0fb32b1e44",
        "bfc6457f12",
        (
            *("evidence/seconds.py", "gaitval/apps/cohort/identity.py"),
            "gaitval/apps/devices/study.py",
            *("gaitval/prediction/normal_form.py", "gaitval/study/run.py"),
            "gaitval/study/stored_policy.py",
        ),
        "strides longer than anybody's in these rows start from another policy: metrics.json of "
        "the ten, and the policy chosen for usual strides, are the same "
        "(tests/workflows/test_general_policy.py)",
    ),
    Equal(
        "aeb94e12c2",
        "679437a5ba",
        ("evidence/seconds.py",),
        "the same loop over starts has a name of its own: tests/workflows/test_general_policy.py",
    ),
    Equal(
        "2d41cbcc03",
        "32d47a67ea",
        (
            *(
                "docs/build/speed_tables.py",
                "gaitval/inverse/residual_derivatives.py",
                "gaitval/inverse/residual_reduction.py",
                "gaitval/apps/devices/adaptation.py",
                "gaitval/apps/devices/engines.py",
                "gaitval/apps/devices/walking.py",
                "gaitval/apps/virtual/standing.py",
                "gaitval/contact/forces.py",
                "gaitval/contact/hunt_crossley.py",
                "gaitval/coordinates.py",
                "gaitval/identification/body_fit.py",
                "gaitval/inverse/foot_anchoring.py",
                "gaitval/inverse/inverse_dynamics.py",
                "gaitval/inverse/inverse_kinematics.py",
                "gaitval/inverse/marked_body.py",
                "gaitval/inverse/marker_derivatives.py",
                "gaitval/inverse/marker_placement.py",
                "gaitval/inverse/model_fit.py",
                "gaitval/inverse/model_fit_solver.py",
                "gaitval/inverse/newton_euler.py",
                "gaitval/inverse/pose_solver.py",
                "gaitval/inverse/segment_lengths.py",
                "gaitval/lanes.py",
                "gaitval/model/body.py",
                "gaitval/model/tree.py",
                "gaitval/model/urdf.py",
                "gaitval/policy/learner.py",
                "gaitval/policy/observation.py",
                "gaitval/policy/policy_update.py",
                "gaitval/policy/rollouts.py",
                "gaitval/policy/walking_group.py",
                "gaitval/reference/dynamic_fit.py",
                "gaitval/reference/walking_laws.py",
                "gaitval/session/subject.py",
                "gaitval/simulation/dynamics.py",
                "gaitval/simulation/physics_steps.py",
                "gaitval/simulation/side_by_side.py",
                "gaitval/simulation/skeleton.py",
                "gaitval/simulation/walker.py",
            ),
        ),
        "the rooms of physics, fit and policy have fewer names for the same arrays, in the same "
        "order of operations: every file of studies with and without own training, of kinematics "
        "and of looked for parameters is the same, byte for byte",
    ),
    Equal(
        "283f0df7ec",
        "c1c0d15516",
        ("gaitval/model/devices/controllers.py", "gaitval/apps/devices/walking.py"),
        "only gravity compensation reads the inclination, and no device of a row has it",
    ),
    Equal(
        "2b42242183",
        "d6ac3fadc7",
        (
            "gaitval/gait/foot_forces.py",
            *("gaitval/interface/motions.py", "gaitval/session/session.py"),
            *("gaitval/inverse/marker_derivatives.py", "gaitval/apps/judge/gait.py"),
        ),
        "the contact of a light person has the same rule in another room, no model that is judged "
        "in a row weighs less than 41 kg, and empty arrays are made by name",
    ),
    Equal(
        "c0b2072a07",
        "b11afa2318",
        (
            *("gaitval/prediction/seen.py", "gaitval/gait/dimensionless.py"),
            *("gaitval/inverse/marker_placement.py", "gaitval/metrics/curve_statistics.py"),
            *("gaitval/metrics/cycles.py", "gaitval/metrics/norms.py"),
            *("gaitval/metrics/validation.py", "gaitval/prediction/normal_form.py"),
            *("gaitval/prediction/speed.py", "gaitval/prediction/speed_line.py"),
            *("gaitval/reporting/recording_report.py", "gaitval/reporting/run_grids.py"),
            "gaitval/study/run.py",
        ),
        "units by leg length and names that stood in several places stand in one: a study, one of "
        "angles alone, its estimate, an import and a held-out speed are the same, byte for byte",
    ),
    Equal(
        "5941c727ba",
        "53d6162810",
        (
            *("gaitval/scaling/markers/picture.py", "gaitval/measurement/said.py"),
            *("gaitval/apps/patients/*.py", "gaitval/apps/live/*"),
        ),
        "the axes of a picture, the words of a warning's remedy and of where a speed is from, and "
        "the order in which a page lists speeds: tests/markers, tests/measurement, tests/patients, "
        "tests/live",
    ),
    Equal(
        "0c3499cb1f",
        "e915bf33fc",
        ("gaitval/mocap/c3d_process.py", "gaitval/scaling/unrecognised.py"),
        "another name of a variable, and the words that names begin with by the library: "
        "tests/mocap, tests/scaling",
    ),
    Equal(
        "f547c8f331",
        "ff12beed35",
        (
            *("gaitval/metrics/baselines.py", "gaitval/metrics/groups.py"),
            *("gaitval/metrics/validation.py", "gaitval/terminal/display.py"),
        ),
        "predictions without a model of the ten people on each of their trials, known whole and "
        "from angles, and groups of the ten stored results are equal bit by bit; nobody's trials "
        "of a row lack forces, or repeat one that was held out (tests/metrics)",
    ),
)
"""Oldest first."""


class Stale(NamedTuple):
    """A row that is not of today's code."""

    topic: str
    what: str
    reason: str


class NoHistory(Exception):
    """The folder is not git's, so nothing can be compared."""


def stale() -> list[Stale]:
    """Every stale row of `reports/evidence`, with the reason.

    Raises
    ------
    NoHistory : there is no `.git`. A history that lacks a row's commit makes that row stale.
    """
    if not (ROOT / ".git").exists():
        raise NoHistory
    found = []
    for path in sorted(evidence.FOLDER.glob("*.csv")):
        for row in evidence.read(path):
            reason = why_stale(row)
            if reason:
                found.append(Stale(path.stem, row["what"], reason))
    return found


def why_stale(row: Mapping[str, str]) -> str:
    """Why a row is stale; "" if it is not."""
    source = source_of(row["command"])
    if source is None:
        return f"its command is none of the project: {row['command']}"
    declared = dependence(source, row["what"])
    if declared is None:
        return f"{source} declares nothing for it in MEASURES"
    return _why(source, declared, row.get("commit", ""))


@cache
def _why(source: str, declared: Dependence, commit: str) -> str:
    """Why rows with a dependence and a commit are stale; "" if they are not."""
    if not commit:
        return "has no commit"
    if commit.endswith(evidence.UNCOMMITTED):
        return f"measured on files that were not committed ({commit})"
    if not _known(commit):
        return f"its commit {commit} is not in this history (a shallow clone has none)"
    if declared.results and (of := evidence.measured_commit(declared.results)[0]) != commit:
        return f"its results are of {of}, the row of {commit}"
    if moved := _changed_data(declared.data, commit):
        return f"{', '.join(moved[:3])} changed since {commit}"
    own = () if any(each.startswith(f"{source}:") for each in declared.code) else (source,)
    count, most = changed_statements((*own, *declared.code), commit)
    if count > declared.allowed:
        return f"{count} statements changed since {commit}, {declared.allowed} allowed ({most})"
    return ""


def _known(commit: str) -> bool:
    command = ["git", "cat-file", "-e", f"{commit}^{{commit}}"]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, check=False)
    return done.returncode == 0


@cache
def _files_of(commit: str | None) -> dict[str, str]:
    """Hash of git by path, of a commit or of the tracked files as they are now. A file of the
    commit that has moved since has the path of today.
    """
    if commit:
        lines = evidence.git("ls-tree", "-r", commit).splitlines()
        found = {line.partition("\t")[2]: line.split()[2] for line in lines}
        for old, new in _moves(commit):
            found[new] = found.pop(old)
        return found
    names = evidence.git("ls-files").splitlines()
    return {name: _hash(path.read_bytes()) for name in names if (path := ROOT / name).is_file()}


def _moves(commit: str) -> list[tuple[str, str]]:
    """Path in a commit and path of today of each file that git sees as moved."""
    options = ("--name-status", "--diff-filter=R", f"--find-renames={MOVED}%", "-z")
    words = evidence.git("diff", *options, commit).split("\0")
    return list(zip(words[1::3], words[2::3], strict=True))


def _hash(content: bytes) -> str:
    return hashlib.sha1(b"blob %d\0" % len(content) + content, usedforsecurity=False).hexdigest()


def _changed_data(patterns: Sequence[str], commit: str) -> list[str]:
    """Files of data that are not as in a commit."""
    found = set()
    for old, new, equal in _steps(commit):
        then, now = _files_of(old), _files_of(new)
        found |= {
            name
            for name in {*then, *now}
            if _matches(name, patterns)
            and not _matches(name, equal)
            and then.get(name) != now.get(name)
            and not (name in then and name in now and _same_content(name, then[name], new))
        }
    return sorted(found)


def _same_content(name: str, blob: str, new: str | None) -> bool:
    """Whether a file differs from what it was in its comments only."""
    if not name.endswith((".toml", ".csv")):  # a file that is no text is among these
        return False
    before = _content(name, blob, past=True)
    after = _content(name, _files_of(new)[name], past=new is not None)
    if name.endswith(".toml"):
        return tomllib.loads(before) == tomllib.loads(after)
    return _uncommented(before) == _uncommented(after)


def _uncommented(text: str) -> list[str]:
    return [line for line in text.splitlines() if not line.startswith("#")]


@cache
def changed_statements(code: tuple[str, ...], commit: str) -> tuple[int, str]:
    """Statements of some code that are not as in a commit, and where most of them are.

    A statement that was replaced counts once, as does one that was added or taken away.
    """
    counts: Counter[str] = Counter()
    for old, new, equal in _steps(commit):
        for name, count in _changed(code, old, new).items():
            if not _matches(name, equal):
                counts[name] += count
    most = ", ".join(f"{name}: {count}" for name, count in counts.most_common(3))
    return counts.total(), most


def _steps(commit: str) -> Iterator[tuple[str, str | None, tuple[str, ...]]]:
    """What lies between a commit and the files of today (None): from where to where, and patterns
    of the files that give the same numbers after it.
    """
    for equal in EQUAL:
        if _is_before(commit, equal.before):
            yield commit, equal.before, ()
            yield equal.before, equal.after, equal.code
            commit = equal.after
    yield commit, None, ()


def _matches(name: str, patterns: Sequence[str]) -> bool:
    return any(fnmatch.fnmatchcase(name, pattern) for pattern in patterns)


@cache
def _is_before(commit: str, other: str) -> bool:
    """Whether a commit is another one, or in its history."""
    command = ["git", "merge-base", "--is-ancestor", commit, other]
    return subprocess.run(command, cwd=ROOT, capture_output=True, check=False).returncode == 0


def _changed(code: tuple[str, ...], old: str, new: str | None) -> Counter[str]:
    """Statements by file that are not as in the commit `old` in `new`, or in the files of today."""
    then, now = _files_of(old), _files_of(new)
    before: dict[str, list[str]] = {}
    after: dict[str, list[str]] = {}
    homes: dict[str, str] = {}
    for name in sorted({*then, *now}):
        only = _named(name, code)
        if only is None or then.get(name) == now.get(name):
            continue
        for tree, where in ((then, before), (now, after)):
            if name in tree:
                past = tree is then or new is not None
                for place, statements in pieces(_content(name, tree[name], past), only).items():
                    where.setdefault(place, []).extend(statements)
                    homes[place] = name
    counts: Counter[str] = Counter()
    for place in {*before, *after}:
        counts[homes[place]] += _differences(before.get(place, []), after.get(place, []))
    return +counts  # without the zeros


def _named(name: str, code: Sequence[str]) -> tuple[str, ...] | None:
    """Definitions of a file that patterns name: () for all, None where none is of the file."""
    found = [
        pattern.partition(":")[2].split(",") if ":" in pattern else []
        for pattern in code
        if fnmatch.fnmatchcase(name, pattern.partition(":")[0])
    ]
    if not found:
        return None
    return tuple(each for names in found for each in names) if all(found) else ()


@cache
def _content(name: str, blob: str, past: bool) -> str:
    if past:
        return evidence.git("cat-file", "blob", blob)
    return (ROOT / name).read_text(encoding="utf-8")


def _differences(before: list[str], after: list[str]) -> int:
    parts = SequenceMatcher(None, before, after, autojunk=False).get_opcodes()
    return sum(max(b - a, d - c) for what, a, b, c, d in parts if what != "equal")


def pieces(text: str, only: Sequence[str] = ()) -> dict[str, list[str]]:
    """Statements of a module by the definition that they are in, without comments and docstrings.

    Parameters
    ----------
    only : names of definitions of the module, where not all count.

    Returns
    -------
    By dotted name (a function, a method, a constant; "" of what defines nothing), the text of each
    statement. Of one that contains others, its own line, and then theirs.
    """
    found: dict[str, list[str]] = {}
    for statement in _WithoutCommand().visit(ast.parse(text)).body:
        names = targets(statement) or ("",)
        if "MEASURES" in names or (only and not set(names) & set(only)):
            continue
        for place, line in _lines(statement, ""):
            found.setdefault(place or names[0], []).append(line)
    return found


class _WithoutCommand(ast.NodeTransformer):
    """Takes away what says which line makes a row: the last argument of the row, the marks of a
    measurement.
    """

    def visit_Call(self, node: ast.Call) -> ast.Call:
        """A row, without its command."""
        self.generic_visit(node)
        name = getattr(node.func, "attr", getattr(node.func, "id", ""))
        if name in ("Row", "none_may"):
            if node.args and _names(node.args[-1]) & COMMANDS:
                node.args.pop()
            node.keywords = [each for each in node.keywords if each.arg != "command"]
        return node

    def visit_FunctionDef(self, node: ast.FunctionDef) -> ast.FunctionDef:
        """A function, without the decorator of a measurement."""
        self.generic_visit(node)
        node.decorator_list = [
            each for each in node.decorator_list if "measurement" not in _names(each)
        ]
        return node


def _names(node: ast.expr) -> set[str]:
    """Every name and attribute in an expression."""
    return {
        name
        for each in ast.walk(node)
        if (name := getattr(each, "id", getattr(each, "attr", None))) is not None
    }


def _lines(statement: ast.stmt, place: str) -> Iterator[tuple[str, str]]:
    if isinstance(statement, ast.Import | ast.ImportFrom) or (
        isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    ):
        return
    if isinstance(statement, ast.FunctionDef | ast.ClassDef):
        place = f"{place}.{statement.name}" if place else statement.name
    own = copy.copy(statement)
    inner: list[ast.stmt] = []
    for name in _BODIES:
        for each in getattr(statement, name, []):
            inner += each.body if isinstance(each, ast.ExceptHandler | ast.match_case) else [each]
        if getattr(statement, name, None) and name in ("body", "orelse", "finalbody"):
            setattr(own, name, [ast.Pass()])
        elif hasattr(own, name):
            emptied = [copy.copy(each) for each in getattr(own, name)]
            for each in emptied:
                each.body = [ast.Pass()]
            setattr(own, name, emptied)
    yield place, ast.unparse(own)
    for each in inner:
        yield from _lines(each, place)


def retire(found: Sequence[Stale]) -> None:
    """Move rows from `reports/evidence` to `reports/evidence/past`."""
    for topic in sorted({each.topic for each in found}):
        source, target = evidence.FOLDER / f"{topic}.csv", PAST / f"{topic}.csv"
        gone = {each.what for each in found if each.topic == topic}
        rows = evidence.read(source)
        past = {row["what"]: row for row in evidence.read(target)} if target.is_file() else {}
        past |= {row["what"]: row for row in rows if row["what"] in gone}
        evidence.save(target, list(past.values()))
        evidence.save(source, [row for row in rows if row["what"] not in gone])


def main(words: Sequence[str]) -> int:
    """Name the stale rows, or move them; the exit code."""
    parser = argparse.ArgumentParser(prog="python -m evidence stale",
                                     description=(__doc__ or "").partition("\n")[0])  # fmt: skip
    parser.add_argument("--retire", action="store_true", help="move them to reports/evidence/past")
    arguments = parser.parse_args(words)
    found = stale()
    for each in found:
        print(f"{each.topic}: {each.what}\n    {each.reason}")
    count = sum(len(evidence.read(path)) for path in evidence.FOLDER.glob("*.csv"))
    print(f"{len(found)} of {count} rows are stale.")
    if arguments.retire:
        retire(found)
        return 0
    return 1 if found else 0
