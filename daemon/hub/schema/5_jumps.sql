-- A walk that goes by jumps (F4 of estimator/fleet): how many a year, and how large. A program that knows nothing of them leaves 0.
ALTER TABLE type_models
  ADD COLUMN jumps_per_year finite NOT NULL DEFAULT 0 CHECK (jumps_per_year >= 0),
  ADD COLUMN jump_sd finite NOT NULL DEFAULT 0 CHECK (jump_sd >= 0);
