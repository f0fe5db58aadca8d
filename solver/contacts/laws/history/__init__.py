"""Laws given by functions of the motion and its history: how they are registered, those of the package."""
