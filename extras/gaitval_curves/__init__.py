"""Subjects from mean curves: tables, the files of WBDS, and the download of published data sets."""
