-- What comes back in the ageing of a parameter (F2 of estimator/fleet): where new units stand and how they differ, how far old ones
-- wander, and in which time. A program that knows nothing of it leaves it at 0.
ALTER TABLE type_models
  ADD COLUMN settling finite NOT NULL DEFAULT 0,
  ADD COLUMN settling_sd finite NOT NULL DEFAULT 0 CHECK (settling_sd >= 0),
  ADD COLUMN wander_sd finite NOT NULL DEFAULT 0 CHECK (wander_sd >= 0),
  ADD COLUMN return_years finite NOT NULL DEFAULT 0 CHECK (return_years >= 0);
