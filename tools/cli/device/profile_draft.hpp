// The text of a profile, changed table by table; comments and order stay.
#pragma once

#include <string>
#include <string_view>

namespace selfcal::cli::device {

class ProfileDraft {
 public:
  explicit ProfileDraft(std::string text) : text_(std::move(text)) {}

  const std::string& text() const { return text_; }
  // The keys before the first table are those of the table "". Each table and line must be there: the drafts are made of our own
  // profile, and a test reads every one of them.
  void set_line(std::string_view table, std::string_view key, std::string_view value, std::string_view new_key = {});
  void erase_line(std::string_view table, std::string_view key);
  void add_line(std::string_view table, std::string_view line);  // at its end
  void set_table(std::string_view table, std::string_view lines);
  void erase_table(std::string_view table);
  void insert_before(std::string_view table, std::string_view text);  // whole tables
  void set_head(std::string_view words);                              // what stands before the key `name`

 private:
  struct Part {
    std::size_t begin = 0, end = 0;  // without the header and the empty line behind it
  };
  Part part(std::string_view table) const;
  Part line(std::string_view table, std::string_view key) const;  // with the end of the line

  std::string text_;
};

}  // namespace selfcal::cli::device
