-- The memory of a depot: what its sets measured, of which units, and which coefficients were in force when.
-- A set writes through submit_run alone; readers and analysts read tables. Times are instants, numbers are finite.
CREATE EXTENSION IF NOT EXISTS btree_gist;

CREATE DOMAIN finite AS double precision CHECK (VALUE > '-Infinity' AND VALUE < 'Infinity');  -- NaN sorts above Infinity
CREATE DOMAIN sha256 AS text CHECK (VALUE ~ '^[0-9a-f]{64}$');
CREATE DOMAIN serial_number AS text CHECK (length(VALUE) BETWEEN 1 AND 64 AND VALUE !~ '[[:cntrl:]]');

-- Elements of the arrays below have this order, name and unit.
CREATE TABLE parameters(
  position smallint PRIMARY KEY CHECK (position BETWEEN 1 AND 24),
  name text NOT NULL UNIQUE,
  unit text NOT NULL CHECK (unit <> ''));
INSERT INTO parameters VALUES
  (1, 'accel_bias_x', 'ug'), (2, 'accel_bias_y', 'ug'), (3, 'accel_bias_z', 'ug'),
  (4, 'gyro_drift_x', 'deg/h'), (5, 'gyro_drift_y', 'deg/h'), (6, 'gyro_drift_z', 'deg/h'),
  (7, 'accel_scale_pos_x', 'ppm'), (8, 'accel_scale_pos_y', 'ppm'), (9, 'accel_scale_pos_z', 'ppm'),
  (10, 'accel_scale_neg_x', 'ppm'), (11, 'accel_scale_neg_y', 'ppm'), (12, 'accel_scale_neg_z', 'ppm'),
  (13, 'accel_misalignment_yx', 'arcsec'), (14, 'accel_misalignment_zx', 'arcsec'),
  (15, 'accel_misalignment_zy', 'arcsec'),
  (16, 'gyro_scale_x', 'ppm'), (17, 'gyro_scale_y', 'ppm'), (18, 'gyro_scale_z', 'ppm'),
  (19, 'gyro_misalignment_xy', 'arcsec'), (20, 'gyro_misalignment_xz', 'arcsec'),
  (21, 'gyro_misalignment_yx', 'arcsec'), (22, 'gyro_misalignment_yz', 'arcsec'),
  (23, 'gyro_misalignment_zx', 'arcsec'), (24, 'gyro_misalignment_zy', 'arcsec');

CREATE FUNCTION are_24_finite(numbers double precision[]) RETURNS boolean IMMUTABLE LANGUAGE sql AS $$
  SELECT array_ndims(numbers) = 1 AND array_lower(numbers, 1) = 1 AND cardinality(numbers) = 24
     AND (SELECT bool_and(n IS NOT NULL AND n > '-Infinity' AND n < 'Infinity') FROM unnest(numbers) n)
$$;
CREATE FUNCTION none_negative(numbers double precision[]) RETURNS boolean IMMUTABLE LANGUAGE sql AS $$
  SELECT bool_and(n >= 0) FROM unnest(numbers) n
$$;
CREATE DOMAIN parameter_values AS double precision[] CHECK (are_24_finite(VALUE));
CREATE DOMAIN parameter_sigmas AS double precision[] CHECK (are_24_finite(VALUE) AND none_negative(VALUE));
CREATE DOMAIN parameter_flags AS boolean[]
  CHECK (array_ndims(VALUE) = 1 AND cardinality(VALUE) = 24 AND array_position(VALUE, NULL) IS NULL);

CREATE TABLE sets(
  name text PRIMARY KEY CHECK (name ~ '^[a-z][a-z0-9_]{0,39}$'),
  role name NOT NULL UNIQUE,                  -- that it logs in as
  last_sequence bigint NOT NULL DEFAULT 0,    -- of its outbox
  last_seen timestamptz,
  software text NOT NULL DEFAULT '');
CREATE TABLE units(
  serial serial_number PRIMARY KEY,
  type text NOT NULL CHECK (type <> ''));     -- profile by which its sets speak to it
CREATE TABLE recordings(
  sha256 sha256 PRIMARY KEY,                  -- the file's name in the shared folder
  bytes bigint NOT NULL CHECK (bytes > 0));

-- Arrivals are committed in the order of their numbers (submit_run): who has read up to one has missed none.
CREATE TABLE runs(
  arrival bigint GENERATED ALWAYS AS IDENTITY PRIMARY KEY,
  set_name text NOT NULL REFERENCES sets,
  sequence bigint NOT NULL CHECK (sequence > 0),
  run bigint NOT NULL CHECK (run > 0),        -- the set's own number
  serial serial_number REFERENCES units,      -- null: it ended before the unit was identified
  kind text NOT NULL CHECK (kind IN ('calibration', 'dry_run', 'rollback', 'amendment')),
  state text NOT NULL CHECK (state IN ('completed', 'refused', 'failed', 'aborted')),
  started timestamptz NOT NULL,
  ended timestamptz NOT NULL,
  software text NOT NULL,
  exit_status smallint NOT NULL,
  reason text NOT NULL,
  operator text NOT NULL,
  recording sha256 REFERENCES recordings,
  result jsonb,                               -- selfcal estimate --json
  content sha256 NOT NULL,                    -- of the document as it was submitted
  received timestamptz NOT NULL DEFAULT now(),
  UNIQUE (set_name, run),
  UNIQUE (set_name, sequence));
CREATE INDEX runs_by_serial ON runs(serial, ended);

-- What a calibration measured.
CREATE TABLE certificates(
  arrival bigint PRIMARY KEY REFERENCES runs ON DELETE CASCADE,
  set_name text NOT NULL REFERENCES sets,
  serial serial_number NOT NULL REFERENCES units,
  at timestamptz NOT NULL,
  value parameter_values NOT NULL,
  sigma parameter_sigmas NOT NULL,
  determined parameter_flags NOT NULL,
  UNIQUE (serial, at));
CREATE INDEX certificates_by_serial ON certificates(serial, arrival);
CREATE INDEX certificates_by_set ON certificates(set_name, at);

-- Which coefficients were in force in a unit when: one set at any instant.
CREATE TABLE validities(
  arrival bigint PRIMARY KEY REFERENCES runs ON DELETE CASCADE,
  serial serial_number NOT NULL REFERENCES units,
  valid tstzrange NOT NULL CHECK (NOT isempty(valid) AND lower_inc(valid) AND NOT lower_inf(valid)),
  coefficients bytea,                         -- as written to the INS; null: the set did not keep them
  EXCLUDE USING gist (serial WITH =, valid WITH &&));

-- What a diagnosis named in a run: effects of the catalogue and laws.
CREATE TABLE findings(
  arrival bigint NOT NULL REFERENCES runs ON DELETE CASCADE,
  serial serial_number NOT NULL REFERENCES units,
  effect text NOT NULL CHECK (effect <> ''),
  parameter text NOT NULL,
  unit text NOT NULL CHECK (unit <> ''),
  value finite NOT NULL,
  sigma finite NOT NULL CHECK (sigma >= 0),
  PRIMARY KEY (arrival, effect, parameter));
CREATE INDEX findings_by_effect ON findings(effect, serial);

-- What was not taken, and why. The set keeps the same line.
CREATE TABLE refusals(
  set_name text NOT NULL REFERENCES sets,
  sequence bigint NOT NULL,
  run bigint NOT NULL,
  reason text NOT NULL CHECK (reason <> ''),
  content sha256 NOT NULL,
  at timestamptz NOT NULL DEFAULT now(),
  PRIMARY KEY (set_name, sequence, content));

-- That data of a unit were deleted, when, by whom and why; never the data.
CREATE TABLE deletions(
  at timestamptz NOT NULL DEFAULT now(),
  serial_sha256 sha256 NOT NULL,
  by_role name NOT NULL DEFAULT session_user,
  reason text NOT NULL CHECK (reason <> ''),
  runs bigint NOT NULL,
  certificates bigint NOT NULL);

CREATE VIEW certificate_parameters AS
  SELECT c.arrival, c.set_name, c.serial, c.at, p.name, p.unit, v.value, v.sigma, v.determined
    FROM certificates c, LATERAL unnest(c.value, c.sigma, c.determined) WITH ORDINALITY v(value, sigma, determined, position)
    JOIN parameters p USING (position);

-- A set of coefficients is valid from its writing to the next one's, in whatever order they arrive.
CREATE FUNCTION begin_validity(p_arrival bigint, p_serial text, p_from timestamptz, p_coefficients bytea)
RETURNS void LANGUAGE plpgsql AS $$
DECLARE until timestamptz;
BEGIN
  SELECT min(lower(valid)) INTO until FROM validities WHERE serial = p_serial AND lower(valid) > p_from;
  UPDATE validities SET valid = tstzrange(lower(valid), p_from)
   WHERE serial = p_serial AND valid @> p_from AND lower(valid) < p_from;
  INSERT INTO validities VALUES (p_arrival, p_serial, tstzrange(p_from, until), p_coefficients);
EXCEPTION WHEN exclusion_violation THEN
  RAISE EXCEPTION 'unit %: another set of coefficients began at % too', p_serial, p_from USING ERRCODE = 'exclusion_violation';
END $$;

-- The document is selfcal.hub_run (daemon/hub/run_message). An error refuses the run as a whole.
CREATE FUNCTION store_run(p_set text, p_sequence bigint, p_run bigint, p_document jsonb, p_content text)
RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  r runs;
  written boolean;
BEGIN
  r.serial := nullif(p_document->>'serial', '');
  r.ended := (p_document->>'ended_utc')::timestamptz;
  IF r.serial IS NOT NULL THEN
    INSERT INTO units VALUES (r.serial, p_document->>'type') ON CONFLICT DO NOTHING;
  END IF;
  IF p_document->'recording' ? 'sha256' THEN
    INSERT INTO recordings VALUES (p_document#>>'{recording,sha256}', (p_document#>>'{recording,bytes}')::bigint)
      ON CONFLICT DO NOTHING;
  END IF;
  INSERT INTO runs(set_name, sequence, run, serial, kind, state, started, ended, software, exit_status, reason, operator,
                   recording, result, content)
  VALUES (p_set, p_sequence, p_run, r.serial, p_document->>'kind', p_document->>'state',
          (p_document->>'started_utc')::timestamptz, r.ended, p_document->>'software',
          (p_document->>'exit_status')::smallint, p_document->>'reason', p_document->>'operator',
          p_document#>>'{recording,sha256}', nullif(p_document->'result', 'null'), p_content)
  RETURNING * INTO r;
  written := r.state = 'completed' AND r.kind <> 'dry_run';
  IF written AND r.serial IS NULL THEN
    RAISE EXCEPTION 'a completed run without serial number' USING ERRCODE = 'check_violation';
  END IF;
  IF jsonb_typeof(p_document->'parameters') = 'array' AND written THEN
    IF EXISTS (SELECT FROM jsonb_array_elements(p_document->'parameters') WITH ORDINALITY e(entry, position)
                 FULL JOIN parameters p USING (position)
                WHERE p.name IS DISTINCT FROM entry->>'name' OR p.unit IS DISTINCT FROM entry->>'unit') THEN
      RAISE EXCEPTION 'parameters: not the 24 in their order and units' USING ERRCODE = 'check_violation';
    END IF;
    INSERT INTO certificates
    SELECT r.arrival, p_set, r.serial, r.ended, array_agg((entry->>'value')::double precision ORDER BY position),
           array_agg((entry->>'sigma')::double precision ORDER BY position),
           array_agg((entry->>'determined')::boolean ORDER BY position)
      FROM jsonb_array_elements(p_document->'parameters') WITH ORDINALITY e(entry, position);
  END IF;
  IF written THEN
    PERFORM begin_validity(r.arrival, r.serial, r.ended, decode(p_document->>'coefficients', 'hex'));
  END IF;
  IF jsonb_typeof(p_document->'findings') = 'array' AND r.serial IS NOT NULL THEN
    INSERT INTO findings
    SELECT r.arrival, r.serial, f->>'effect', q->>'name', q->>'unit', (q->>'value')::finite, (q->>'sigma')::finite
      FROM jsonb_array_elements(p_document->'findings') f, jsonb_array_elements(f->'parameters') q;
  END IF;
END $$;

-- Called by a set for each entry of its outbox, in order. What it answers: 'stored', 'present' (received before, the same
-- content), or 'refused: ' and why. A refusal is stored too; an error is none of the run's and is tried again.
CREATE FUNCTION submit_run(p_sequence bigint, p_run bigint, p_document jsonb) RETURNS text
LANGUAGE plpgsql SECURITY DEFINER AS $$
DECLARE
  s sets;
  p_content text := encode(sha256(convert_to(p_document::text, 'UTF8')), 'hex');
  known text;
  why text;
BEGIN
  PERFORM pg_advisory_xact_lock(hashtext('selfcal.arrivals'));   -- arrival numbers in the order of commits
  SELECT * INTO s FROM sets WHERE role = session_user;
  IF NOT FOUND THEN
    RAISE EXCEPTION 'role % belongs to no set', session_user USING ERRCODE = 'insufficient_privilege';
  END IF;
  SELECT content INTO known FROM runs WHERE set_name = s.name AND run = p_run;
  IF known = p_content THEN
    RETURN 'present';
  END IF;
  SELECT reason INTO why FROM refusals WHERE set_name = s.name AND sequence = p_sequence AND content = p_content;
  IF FOUND THEN
    RETURN 'refused: ' || why;
  END IF;
  IF known IS NOT NULL THEN
    why := format('run %s was received before with another content', p_run);
  ELSIF p_sequence <= s.last_sequence THEN
    why := format('sequence %s after %s: the database of the set is older than what it sent', p_sequence, s.last_sequence);
  ELSE
    BEGIN
      PERFORM store_run(s.name, p_sequence, p_run, p_document, p_content);
    EXCEPTION WHEN data_exception OR integrity_constraint_violation THEN
      why := SQLERRM;
    END;
  END IF;
  UPDATE sets SET last_sequence = greatest(last_sequence, p_sequence), last_seen = now(),
                  software = coalesce(p_document->>'software', software) WHERE name = s.name;
  IF why IS NULL THEN
    RETURN 'stored';
  END IF;
  why := replace(why, E'\n', ' ');
  INSERT INTO refusals(set_name, sequence, run, reason, content) VALUES (s.name, p_sequence, p_run, why, p_content);
  RETURN 'refused: ' || why;
END $$;

-- What other sets measured of these units, each after the arrival that the set has.
CREATE FUNCTION units_past(p_serials text[], p_after bigint[])
RETURNS TABLE(arrival bigint, set_name text, run bigint, serial text, at timestamptz, value double precision[],
              sigma double precision[], determined boolean[])
LANGUAGE sql STABLE SECURITY DEFINER AS $$
  SELECT c.arrival, c.set_name, r.run, c.serial::text, c.at, c.value::double precision[], c.sigma::double precision[],
         c.determined::boolean[]
    FROM unnest(p_serials, p_after) wanted(serial, after)
    JOIN certificates c ON c.serial = wanted.serial AND c.arrival > wanted.after
    JOIN runs r ON r.arrival = c.arrival
    JOIN sets s ON s.name = c.set_name
   WHERE s.role <> session_user AND EXISTS (SELECT FROM sets WHERE role = session_user)
   ORDER BY c.arrival LIMIT 10000
$$;

-- Deletes all that was measured of a unit, on request; a trace without the data stays. Files of recordings that no run
-- needs any more are returned, for whoever deletes them.
CREATE FUNCTION forget_unit(p_serial text, p_reason text) RETURNS SETOF text
LANGUAGE plpgsql SECURITY DEFINER AS $$
DECLARE
  n_runs bigint;
  n_certificates bigint;
  files text[];
BEGIN
  PERFORM pg_advisory_xact_lock(hashtext('selfcal.arrivals'));
  SELECT count(*) INTO n_certificates FROM certificates WHERE serial = p_serial;
  SELECT array_agg(DISTINCT recording) INTO files FROM runs WHERE serial = p_serial AND recording IS NOT NULL;
  DELETE FROM runs WHERE serial = p_serial;
  GET DIAGNOSTICS n_runs = ROW_COUNT;
  DELETE FROM units WHERE serial = p_serial;
  IF NOT FOUND THEN
    RAISE EXCEPTION 'unit %: not known', p_serial USING ERRCODE = 'no_data_found';
  END IF;
  INSERT INTO deletions(serial_sha256, reason, runs, certificates)
  VALUES (encode(sha256(convert_to(p_serial, 'UTF8')), 'hex'), p_reason, n_runs, n_certificates);
  RETURN QUERY DELETE FROM recordings g WHERE g.sha256 = ANY(files)
    AND NOT EXISTS (SELECT FROM runs r WHERE r.recording = g.sha256) RETURNING g.sha256::text;
END $$;

CREATE FUNCTION admit_set(p_name text, p_role name) RETURNS void LANGUAGE sql AS $$
  INSERT INTO sets(name, role) VALUES (p_name, p_role)
$$;

-- Group roles belong to the whole server.
DO $$
DECLARE r text;
BEGIN
  FOREACH r IN ARRAY ARRAY['selfcal_set', 'selfcal_reader', 'selfcal_analyst'] LOOP
    IF NOT EXISTS (SELECT FROM pg_roles WHERE rolname = r) THEN
      EXECUTE format('CREATE ROLE %I NOLOGIN', r);
    END IF;
  END LOOP;
END $$;
-- These run with the owner's rights, so no caller's schema may stand in for ours.
ALTER FUNCTION submit_run SET search_path = selfcal, public, pg_temp;
ALTER FUNCTION units_past SET search_path = selfcal, public, pg_temp;
ALTER FUNCTION forget_unit SET search_path = selfcal, public, pg_temp;
REVOKE EXECUTE ON ALL FUNCTIONS IN SCHEMA selfcal FROM PUBLIC;
GRANT USAGE ON SCHEMA selfcal TO selfcal_set, selfcal_reader, selfcal_analyst;
GRANT SELECT ON schema_version TO selfcal_set, selfcal_reader, selfcal_analyst;
GRANT EXECUTE ON FUNCTION submit_run, units_past TO selfcal_set;
GRANT SELECT ON ALL TABLES IN SCHEMA selfcal TO selfcal_reader, selfcal_analyst;
