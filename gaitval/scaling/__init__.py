"""From measurements to lengths and masses: by markers, marker pairs, tape or stature."""
