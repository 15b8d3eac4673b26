"""What is wrong with the records, and the records as the fits take them."""
