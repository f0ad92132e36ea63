"""From measurements to lengths and masses: markers, pairs, tape, stature."""
