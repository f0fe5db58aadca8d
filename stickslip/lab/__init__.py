"""What few ask: one folder a capability, on top of everything else like an extension.

Nothing outside imports one of them: each enters by name in the registries, so that a folder can be deleted
and the rest stands.
"""
