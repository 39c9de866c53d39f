"""Studies as tables: cases by methods, a row of figures for each motion, on any executor, resumed where they ended."""
