//! Direct-illumination estimators with points, lines and closed forms, and the plan of what to skip.
