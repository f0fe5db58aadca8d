"""Studies of designs: Campbell diagrams, sensitivities, Pareto fronts."""
