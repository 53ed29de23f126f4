"""Frames, whatever file or memory holds them: what formats, pictures and jobs share."""
