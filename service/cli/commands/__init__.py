"""Commands that are made of what is registered, not written one by one."""
