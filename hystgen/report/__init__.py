"""Words and pictures about models and fits."""
