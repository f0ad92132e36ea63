"""A walk in the hand: a person walks now, in a local page, with speed, body and pushes to try."""
