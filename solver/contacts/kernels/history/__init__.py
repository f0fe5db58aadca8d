"""Laws that follow the history of the motion from node to node of a period: contracts, partials, turns."""
