"""Marker sets drafted from a recording: from names, from places on the body, from a walk."""
