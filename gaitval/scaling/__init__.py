"""From measurements to lengths and masses: by markers, tape or stature."""
