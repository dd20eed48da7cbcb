-- What the fleet's model (estimator/fleet) makes of the certificates. One fit at a time: a new one takes the old one's place in one
-- transaction, so that a question always meets a whole one.
CREATE TABLE limits(
  type text NOT NULL,
  position smallint NOT NULL REFERENCES parameters,
  change finite CHECK (change > 0),   -- that a parameter may change by since its last calibration
  size finite CHECK (size > 0),       -- beyond which it is implausible for the type
  PRIMARY KEY (type, position));
CREATE TABLE fits(
  id bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  at timestamptz NOT NULL DEFAULT now(),
  by_role name NOT NULL DEFAULT session_user,
  software text NOT NULL,
  arrival bigint NOT NULL);            -- the last that it has seen
CREATE TABLE type_models(
  fit bigint NOT NULL REFERENCES fits ON DELETE CASCADE,
  type text NOT NULL,
  position smallint NOT NULL REFERENCES parameters,
  mean finite NOT NULL, ramp_per_year finite NOT NULL,
  unit_sd finite NOT NULL, ramp_sd finite NOT NULL, walk_sd finite NOT NULL, setup_sd finite NOT NULL, set_sd finite NOT NULL,
  PRIMARY KEY (type, position));
CREATE TABLE set_offsets(
  fit bigint NOT NULL REFERENCES fits ON DELETE CASCADE,
  set_name text NOT NULL REFERENCES sets,
  type text NOT NULL,
  position smallint NOT NULL REFERENCES parameters,
  value finite NOT NULL, sigma finite NOT NULL,       -- over all its measurements
  bias finite NOT NULL, z finite NOT NULL,            -- over its last units
  units integer NOT NULL,
  accused boolean NOT NULL,
  PRIMARY KEY (set_name, type, position));
CREATE TABLE forecasts(
  fit bigint NOT NULL REFERENCES fits ON DELETE CASCADE,
  serial serial_number PRIMARY KEY REFERENCES units ON DELETE CASCADE,
  last timestamptz NOT NULL,
  due timestamptz NOT NULL,
  due_parameter smallint REFERENCES parameters,       -- that asks for it; null: the longest interval
  level parameter_values NOT NULL, level_sigma parameter_sigmas NOT NULL,   -- true values at the last calibration
  next parameter_values NOT NULL, next_sigma parameter_sigmas NOT NULL,     -- that a calibration at `due` measures
  ramp parameter_values NOT NULL, ramp_sigma parameter_sigmas NOT NULL,     -- per year
  passes timestamptz, passes_parameter smallint REFERENCES parameters);     -- first to pass its `size`
CREATE INDEX forecasts_by_due ON forecasts(due);

GRANT SELECT ON limits, fits, type_models, set_offsets, forecasts TO selfcal_reader, selfcal_analyst;
GRANT INSERT, UPDATE, DELETE ON limits, fits, type_models, set_offsets, forecasts TO selfcal_analyst;
GRANT EXECUTE ON FUNCTION are_24_finite, none_negative TO selfcal_analyst;
