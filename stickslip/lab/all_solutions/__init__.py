"""All the responses there are at one frequency, as far as a search finds them."""
