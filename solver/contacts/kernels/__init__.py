"""Compiled contact laws."""
