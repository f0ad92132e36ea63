"""The stages as Python functions: `import gaitval as gv`."""
