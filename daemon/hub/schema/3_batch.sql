-- Results of batches, by the key of the task that made them: SHA-256 of what the result follows from. A key has one result.
CREATE TABLE batch_results(
  key sha256 PRIMARY KEY,
  step text NOT NULL CHECK (step <> ''),
  version text NOT NULL,                       -- of the program
  recording sha256,                            -- that it answers for; null: one that a batch drew itself
  content sha256 NOT NULL,
  result text NOT NULL CHECK (encode(sha256(convert_to(result, 'UTF8')), 'hex') = content),
  by_role name NOT NULL DEFAULT session_user,
  at timestamptz NOT NULL DEFAULT now());
CREATE INDEX batch_results_by_recording ON batch_results(recording);

-- How far batches are, as their drivers told last.
CREATE TABLE batches(
  id sha256 PRIMARY KEY,                       -- of its tasks' keys
  kind text NOT NULL,
  version text NOT NULL,
  tasks bigint NOT NULL,
  done bigint NOT NULL,
  failed bigint NOT NULL,
  begun timestamptz NOT NULL DEFAULT now(),
  told timestamptz NOT NULL DEFAULT now(),
  CHECK (tasks > 0 AND done >= 0 AND failed >= 0 AND done + failed <= tasks));

-- 'stored', 'present' (the same to the byte) or 'differs', and then nothing is changed.
CREATE FUNCTION keep_result(p_key text, p_step text, p_version text, p_recording text, p_result text) RETURNS text
LANGUAGE plpgsql AS $$
DECLARE p_content text := encode(sha256(convert_to(p_result, 'UTF8')), 'hex');
BEGIN
  INSERT INTO batch_results(key, step, version, recording, content, result)
  VALUES (p_key, p_step, p_version, p_recording, p_content, p_result) ON CONFLICT DO NOTHING;
  IF FOUND THEN
    RETURN 'stored';
  END IF;
  RETURN (SELECT CASE WHEN content = p_content THEN 'present' ELSE 'differs' END FROM batch_results WHERE key = p_key);
END $$;

CREATE FUNCTION note_batch(p_id text, p_kind text, p_version text, p_tasks bigint, p_done bigint, p_failed bigint) RETURNS void
LANGUAGE sql AS $$
  INSERT INTO batches(id, kind, version, tasks, done, failed) VALUES (p_id, p_kind, p_version, p_tasks, p_done, p_failed)
  ON CONFLICT (id) DO UPDATE SET done = excluded.done, failed = excluded.failed, told = now()
$$;

-- What was found in a recording goes with it.
CREATE FUNCTION forget_results() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
  DELETE FROM batch_results WHERE recording = OLD.sha256;
  RETURN NULL;
END $$;
CREATE TRIGGER recording_forgotten AFTER DELETE ON recordings FOR EACH ROW EXECUTE FUNCTION forget_results();
ALTER FUNCTION forget_results SET search_path = selfcal, public, pg_temp;

REVOKE EXECUTE ON FUNCTION keep_result, note_batch, forget_results FROM PUBLIC;
GRANT SELECT ON batch_results, batches TO selfcal_reader, selfcal_analyst;
GRANT INSERT ON batch_results TO selfcal_analyst;
GRANT INSERT, UPDATE ON batches TO selfcal_analyst;
GRANT EXECUTE ON FUNCTION keep_result, note_batch TO selfcal_analyst;
