"""`sweep` and its ways: walked, point by point, with as many harmonics as accuracy takes."""
