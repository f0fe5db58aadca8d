"""Search methods: local, global, tracked."""
