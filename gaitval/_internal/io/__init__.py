"""Files: read behind one gate, written whole or not at all."""
