"""The proof: campaigns of an independent plant, sealed, diagnosed by the command line, opened and scored."""
