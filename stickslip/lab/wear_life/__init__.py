"""Wear over life: depths of the contacts, loads and response over hours, the least worn peak."""
