// Results of a batch in the depot's hub, by key: what is there is taken from there, what is new goes there.
#pragma once

#include <memory>
#include <set>
#include <string>

#include "daemon/hub/hub_connection.hpp"
#include "tools/batch/batch_folder.hpp"

namespace selfcal::batch {

class HubResults {
 public:
  // Folder and its plan outlive it. An error (device) where the hub does not answer.
  static Expected<std::unique_ptr<HubResults>> open(const std::string& connection, const BatchFolder& folder);

  // Results that the hub has and the folder lacks come into the folder; those that the folder has and the hub lacks are
  // offered. How many came. An error (internal) where both have one and they differ.
  Expected<std::size_t> exchange(BatchFolder& folder);

  // To be sent; sends when enough have gathered. A hub that is away holds nothing up: what waits is sent later.
  void offer(std::size_t task);
  // Sends what waits, trying for `patience_s`. An error (device) tells how many still wait; (internal) that the hub has
  // another result under the same key.
  Expected<void> flush(double patience_s);

  std::size_t stored() const { return stored_; }
  std::size_t present() const { return present_; }  // it had them, the same to the byte
  double seconds() const { return seconds_; }       // spent in sending

 private:
  HubResults(std::string connection, const BatchFolder& folder) : parameters_(std::move(connection)), folder_(folder) {}
  Expected<void> connect();
  Expected<void> send();  // up to 50 in one transaction
  Expected<void> send_in_transaction(const std::vector<std::size_t>& tasks);
  Expected<void> note_batch();

  std::string parameters_;
  const BatchFolder& folder_;
  std::unique_ptr<hub::Connection> connection_;
  std::set<std::size_t> waiting_;
  std::string differs_;  // the first that did
  double not_before_s_ = 0.0, seconds_ = 0.0;
  std::size_t stored_ = 0, present_ = 0;
};

}  // namespace selfcal::batch
