"""The pytest plug-in: accuracy tests against stored baselines, in any project."""
