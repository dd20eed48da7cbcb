#include "protocol/ins_interface/identifiers.hpp"

#include <algorithm>

namespace selfcal::ins {

const std::array<DataIdentifier, 10> data_identifiers = {{
    {did::state, "state", Access::open, false, "StateRecord"},
    {did::schedule, "schedule", Access::unlocked, true, "ScheduleRecord"},
    {did::site, "site", Access::unlocked, true, "SiteRecord"},
    {did::coefficients_in_force, "coefficientsInForce", Access::open, false, "Coefficients"},
    {did::coefficients_inactive, "coefficientsInactive", Access::unlocked, true, "Coefficients"},
    {did::coefficients_factory, "coefficientsFactory", Access::open, false, "Coefficients"},
    {did::raw_data_directory, "rawDataDirectory", Access::open, false, "DirectoryRecord"},
    {did::sample_format, "sampleFormat", Access::open, false, "SampleFormatRecord"},
    {did::serial_number, "ecuSerialNumber", Access::open, false, "ASCII"},
    {did::software_version, "systemSupplierEcuSoftwareVersionNumber", Access::open, false, "ASCII"},
}};

const std::array<Routine, 4> routines = {{
    {routine::self_calibration, "selfCalibration", "start: run id u32; stop; result: RunRecord"},
    {routine::erase_inactive, "eraseInactiveCoefficients", "start"},
    {routine::commit_coefficients, "commitCoefficients", "start: CRC-32C u32 of the record"},
    {routine::navigation_check, "navigationCheck",
     "start: NavigationCheckRequest; stop; result: NavigationCheckRecord"},
}};

namespace {

template <typename Table>
std::string_view name_in(const Table& table, std::uint16_t id) {
  const auto found = std::ranges::find(table, id, [](const auto& entry) { return entry.id; });
  return found == table.end() ? "unknown" : found->name;
}

}  // namespace

std::string_view did_name(std::uint16_t did) { return name_in(data_identifiers, did); }
std::string_view routine_name(std::uint16_t routine) { return name_in(routines, routine); }

}  // namespace selfcal::ins
