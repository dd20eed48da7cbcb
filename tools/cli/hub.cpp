// selfcal hub init | migrate | check | admit | forget: the depot's database, for whoever keeps it; outbox: what of a set is there.
#include <fmt/format.h>
#include <openssl/rand.h>

#include <array>
#include <filesystem>
#include <memory>

#include "daemon/hub/hub_schema.hpp"
#include "daemon/hub/outbox.hpp"
#include "daemon/hub/recording_folder.hpp"
#include "daemon/store/database_copies.hpp"
#include "tools/cli/command.hpp"
#include "tools/cli/hub_option.hpp"

namespace selfcal::cli {
namespace {

struct Arguments {
  std::string hub, recordings, name, kind = "set", serial, reason, state_directory = "/var/lib/selfcal";
};

using Connection = hub::Connection;

Expected<int> init(Connection& connection, const Arguments&) {
  const auto version = hub::version_of(connection);
  if (!version) {
    return tl::unexpected(version.error());
  }
  if (*version != 0) {
    return fail(ErrorKind::bad_input, fmt::format("hub {}: there is one of schema version {} (selfcal hub migrate)",
                                                  connection.place(), *version));
  }
  const auto before = hub::migrate(connection);
  if (!before) {
    return tl::unexpected(before.error());
  }
  fmt::print("hub {}: made, schema version {}\n", connection.place(), hub::known_version());
  return 0;
}

Expected<int> migrate(Connection& connection, const Arguments&) {
  const auto version = hub::version_of(connection);
  if (!version) {
    return tl::unexpected(version.error());
  }
  if (*version == 0) {
    return fail(ErrorKind::bad_input, fmt::format("hub {}: no hub there (selfcal hub init)", connection.place()));
  }
  const auto before = hub::migrate(connection);
  if (!before) {
    return tl::unexpected(before.error());
  }
  fmt::print("hub {}: schema version {}{}\n", connection.place(), hub::known_version(),
             *before == hub::known_version() ? " already" : fmt::format(", {} before", *before));
  return 0;
}

Expected<int> check(Connection& connection, const Arguments& arguments) {
  const auto faults = hub::check(connection, arguments.recordings);
  if (!faults) {
    return tl::unexpected(faults.error());
  }
  for (const std::string& fault : *faults) {
    fmt::print("{}\n", fault);
  }
  if (faults->empty()) {
    fmt::print("hub {}: sound, schema version {}\n", connection.place(), hub::known_version());
  }
  return faults->empty() ? 0 : 1;
}

// 192 bits; nobody types it.
Expected<std::string> fresh_password() {
  std::array<unsigned char, 24> bytes{};
  if (RAND_bytes(bytes.data(), static_cast<int>(bytes.size())) != 1) {
    return fail(ErrorKind::internal, "no random numbers for a password");
  }
  std::string text;
  for (const unsigned char byte : bytes) {
    text += fmt::format("{:02x}", byte);
  }
  return text;
}

Expected<int> admit(Connection& connection, const Arguments& arguments) {
  const auto password = fresh_password();
  if (!password) {
    return tl::unexpected(password.error());
  }
  if (auto ok = hub::admit(connection, arguments.kind, arguments.name, *password); !ok) {
    return tl::unexpected(ok.error());
  }
  fmt::print("{}\n", *password);
  return 0;
}

Expected<int> forget(Connection& connection, const Arguments& arguments) {
  if (arguments.reason.empty()) {
    return fail(ErrorKind::usage, "--reason is missing: it is kept as the trace");
  }
  const auto rows = connection.ask("SELECT forget_unit($1, $2)", {arguments.serial, arguments.reason});
  if (!rows) {
    return tl::unexpected(rows.error());
  }
  int removed = 0;
  for (int i = 0; i < rows->size() && !arguments.recordings.empty(); ++i) {
    std::error_code error;
    removed += std::filesystem::remove(hub::recording_path(arguments.recordings, rows->text(i, 0)), error) ? 1 : 0;
    if (error) {
      return fail(ErrorKind::device, fmt::format("recording {}: {}", rows->text(i, 0), error.message()));
    }
  }
  fmt::print("unit {} is forgotten; {} of {} recordings that only it needed are removed\n", arguments.serial, removed,
             rows->size());
  return 0;
}

// Of this set, from its own database: the hub need not be there. Status 1 where something was refused.
Expected<int> outbox(const Arguments& arguments) {
  const auto outbox = hub::Outbox::open(database_path(arguments.state_directory));
  if (!outbox) {
    return tl::unexpected(outbox.error());
  }
  const auto counts = (*outbox)->counts();
  const auto refused = (*outbox)->refused();
  if (!counts || !refused) {
    return tl::unexpected(counts ? refused.error() : counts.error());
  }
  fmt::print("sent {}, refused {}, waiting {}\n", counts->sent, counts->refused, counts->waiting);
  for (const hub::RefusedRun& run : *refused) {
    fmt::print("run {}: {}\n", run.run, run.reason);
  }
  return refused->empty() ? 0 : 1;
}

CommandRun configure(Options& options) {
  auto arguments = std::make_shared<Arguments>();
  struct Below {
    Options options;
    Expected<int> (*run)(Connection&, const Arguments&);
  };
  auto all = std::make_shared<std::vector<Below>>();
  const auto add = [&](const char* name, const char* help, auto run) -> Options& {
    all->push_back({options.command(name, help), run});
    all->back().options.text("--hub", arguments->hub, hub_help);
    return all->back().options;
  };
  all->reserve(5);
  add("init", "makes the hub in an empty database", init);
  add("migrate", "takes the hub to this program's schema version", migrate);
  add("check", "whether the hub is sound: a line each fault, status 1 if there is one", check)
      .text("--recordings", arguments->recordings, "shared folder, whose files are hashed");
  Options& admitted = add("admit", "lets a set or a person log in; prints the password", admit);
  admitted.text("NAME", arguments->name, "of the set or role", Needed::yes);
  admitted.choice("--as", arguments->kind, {"set", "reader", "analyst"}, "what it may do");
  Options& forgotten = add("forget", "deletes all that was measured of a unit; a trace without the data stays", forget);
  forgotten.text("SERIAL", arguments->serial, "of the unit", Needed::yes);
  forgotten.text("--reason", arguments->reason, "kept with the trace");
  forgotten.text("--recordings", arguments->recordings, "shared folder, from which its recordings are removed too");
  auto own = std::make_shared<Options>(
      options.command("outbox", "what this set has sent, and what was refused; status 1 if something was"));
  own->text("--state-directory", arguments->state_directory, "of the service");
  return [arguments, all, own]() -> Expected<int> {
    if (own->chosen()) {
      return outbox(*arguments);
    }
    for (const Below& below : *all) {
      if (below.options.chosen()) {
        auto connection = Connection::open(hub_connection_string(arguments->hub));
        return connection ? below.run(**connection, *arguments) : tl::unexpected(connection.error());
      }
    }
    return fail(ErrorKind::internal, "hub: no command chosen");
  };
}

const CommandRegistration registration{{"hub", "a depot's memory: make it, upgrade it, check it", configure}};

}  // namespace
}  // namespace selfcal::cli
