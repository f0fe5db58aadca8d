"""Posterior distributions of what is identified: samples, evidence, model choice, reassemblies."""
