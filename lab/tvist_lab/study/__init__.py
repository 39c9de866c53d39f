"""Studies as tables: cases by methods, a row per motion, on any executor, resumable."""
