"""From a session's files to the files of a subject: what an import reads, writes and refuses."""
