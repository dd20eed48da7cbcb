-- A recording of another test set that was imported as a run: with its source; measured, and never in force. The fleet's model does not
-- take it: nobody knows what the other test set adds. A set tells the source; to a hub of an older schema such a run is a dry run.
ALTER TABLE runs
  ADD COLUMN source text NOT NULL DEFAULT '',
  DROP CONSTRAINT runs_kind_check,
  ADD CONSTRAINT runs_kind_check CHECK (kind IN ('calibration', 'dry_run', 'rollback', 'amendment', 'recording')),
  ADD CONSTRAINT runs_source_check CHECK ((kind = 'recording') = (source <> ''));
CREATE TABLE measurements(
  arrival bigint PRIMARY KEY REFERENCES runs ON DELETE CASCADE,
  serial serial_number NOT NULL REFERENCES units,
  at timestamptz NOT NULL,
  value parameter_values NOT NULL,
  sigma parameter_sigmas NOT NULL,
  determined parameter_flags NOT NULL);
CREATE INDEX measurements_by_serial ON measurements(serial, arrival);

-- The document is selfcal.hub_run (daemon/hub/run_message). An error refuses the run as a whole.
CREATE OR REPLACE FUNCTION store_run(p_set text, p_sequence bigint, p_run bigint, p_document jsonb, p_content text)
RETURNS void LANGUAGE plpgsql AS $$
DECLARE
  r runs;
  measured boolean;
  written boolean;
  m measurements;
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
  r.source := coalesce(p_document->>'source', '');
  r.kind := CASE WHEN r.source <> '' THEN 'recording' ELSE p_document->>'kind' END;
  INSERT INTO runs(set_name, sequence, run, serial, kind, source, state, started, ended, software, exit_status, reason, operator,
                   recording, result, content)
  VALUES (p_set, p_sequence, p_run, r.serial, r.kind, r.source, p_document->>'state',
          (p_document->>'started_utc')::timestamptz, r.ended, p_document->>'software',
          (p_document->>'exit_status')::smallint, p_document->>'reason', p_document->>'operator',
          p_document#>>'{recording,sha256}', nullif(p_document->'result', 'null'), p_content)
  RETURNING * INTO r;
  measured := r.state = 'completed' AND r.kind <> 'dry_run';
  written := measured AND r.kind <> 'recording';
  IF measured AND r.serial IS NULL THEN
    RAISE EXCEPTION 'a completed run without serial number' USING ERRCODE = 'check_violation';
  END IF;
  IF jsonb_typeof(p_document->'parameters') = 'array' AND measured THEN
    IF EXISTS (SELECT FROM jsonb_array_elements(p_document->'parameters') WITH ORDINALITY e(entry, position)
                 FULL JOIN parameters p USING (position)
                WHERE p.name IS DISTINCT FROM entry->>'name' OR p.unit IS DISTINCT FROM entry->>'unit') THEN
      RAISE EXCEPTION 'parameters: not the 24 in their order and units' USING ERRCODE = 'check_violation';
    END IF;
    SELECT r.arrival, r.serial, r.ended, array_agg((entry->>'value')::double precision ORDER BY position),
           array_agg((entry->>'sigma')::double precision ORDER BY position),
           array_agg((entry->>'determined')::boolean ORDER BY position)
      INTO m FROM jsonb_array_elements(p_document->'parameters') WITH ORDINALITY e(entry, position);
    IF written THEN
      INSERT INTO certificates VALUES (m.arrival, p_set, m.serial, m.at, m.value, m.sigma, m.determined);
    ELSE
      INSERT INTO measurements VALUES (m.*);
    END IF;
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

-- What other sets measured of these units, each after the arrival that the set has.
CREATE OR REPLACE FUNCTION units_past(p_serials text[], p_after bigint[])
RETURNS TABLE(arrival bigint, set_name text, run bigint, serial text, at timestamptz, value double precision[],
              sigma double precision[], determined boolean[])
LANGUAGE sql STABLE SECURITY DEFINER AS $$
  SELECT c.arrival, r.set_name, r.run, c.serial::text, c.at, c.value::double precision[], c.sigma::double precision[],
         c.determined::boolean[]
    FROM unnest(p_serials, p_after) wanted(serial, after)
    JOIN (SELECT arrival, serial, at, value, sigma, determined FROM certificates
          UNION ALL SELECT arrival, serial, at, value, sigma, determined FROM measurements) c
      ON c.serial = wanted.serial AND c.arrival > wanted.after
    JOIN runs r ON r.arrival = c.arrival
    JOIN sets s ON s.name = r.set_name
   WHERE s.role <> session_user AND EXISTS (SELECT FROM sets WHERE role = session_user)
   ORDER BY c.arrival LIMIT 10000
$$;

ALTER FUNCTION units_past SET search_path = selfcal, public, pg_temp;
GRANT SELECT ON measurements TO selfcal_reader, selfcal_analyst;
