"""Studies as tables: cases by methods, one row of figures for each motion, on any runner, resumed where they ended."""
