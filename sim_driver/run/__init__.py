"""Running a mission: in processes or in virtual time, from its folder to its metrics."""
