"""Log-in at an OpenID Connect provider."""
