"""One periodic response and what is read off it: histories, power, wear, stability."""
