"""Reports, plots and text about models, fits and diagnoses."""
