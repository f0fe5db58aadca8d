"""FrictionBench: cases of friction damping with answers to ten digits, and a score of any code."""
