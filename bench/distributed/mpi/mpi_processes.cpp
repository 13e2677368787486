#include "distributed/mpi/mpi_processes.hpp"

#include <fmt/format.h>
#include <mpi.h>

#include <algorithm>
#include <stdexcept>
#include <thread>
#include <utility>

namespace llmt::apps {
namespace {

using Clock = std::chrono::steady_clock;

// MPI counts bytes of a message as int.
constexpr std::uint64_t bytes_of_message = std::uint64_t{1} << 30;

// Between two looks at a message: processes may share a processor.
constexpr std::chrono::microseconds pause{200};

}  // namespace

MpiProcesses::MpiProcesses(std::chrono::duration<double> patience) : patience_(patience) {
  MPI_Comm_rank(MPI_COMM_WORLD, &rank_);
  MPI_Comm_size(MPI_COMM_WORLD, &count_);
}

// Waits for a message that `begin` begins, to or from `other`.
template <class Begin>
void MpiProcesses::transfer(int other, const Begin& begin) {
  MPI_Request request{};
  begin(&request);
  const Clock::time_point asked = Clock::now();
  for (int done = 0;;) {
    MPI_Test(&request, &done, MPI_STATUS_IGNORE);
    const std::chrono::duration<double> passed = Clock::now() - asked;
    if (done != 0) {
      waited_ += passed;
      return;
    }
    if (passed > patience_) {
      throw std::runtime_error(fmt::format("process {} has waited {:.0f} s for process {}: see --patience", rank_,
                                           patience_.count(), other));
    }
    std::this_thread::sleep_for(pause);
  }
}

void MpiProcesses::send(const std::string& bytes, int to) {
  const std::uint64_t size = bytes.size();
  transfer(to, [&](MPI_Request* request) { MPI_Isend(&size, 1, MPI_UINT64_T, to, 0, MPI_COMM_WORLD, request); });
  for (std::uint64_t at = 0; at < size; at += bytes_of_message) {
    const int count = static_cast<int>(std::min(bytes_of_message, size - at));
    transfer(to, [&](MPI_Request* request) {
      MPI_Isend(bytes.data() + at, count, MPI_BYTE, to, 0, MPI_COMM_WORLD, request);
    });
  }
}

std::string MpiProcesses::receive(int from) {
  std::uint64_t size = 0;
  transfer(from, [&](MPI_Request* request) { MPI_Irecv(&size, 1, MPI_UINT64_T, from, 0, MPI_COMM_WORLD, request); });
  std::string bytes(size, '\0');
  for (std::uint64_t at = 0; at < size; at += bytes_of_message) {
    const int count = static_cast<int>(std::min(bytes_of_message, size - at));
    transfer(from, [&](MPI_Request* request) {
      MPI_Irecv(bytes.data() + at, count, MPI_BYTE, from, 0, MPI_COMM_WORLD, request);
    });
  }
  received_ += size;
  return bytes;
}

distributed::Sums MpiProcesses::merged(distributed::Sums own) {
  for (int step = 1; step < count_; step *= 2) {
    if (rank_ % (2 * step) != 0) {
      send(own.to_bytes(), rank_ - step);
      return {};
    }
    const int other = rank_ + step;
    if (other >= count_) continue;
    own = merge(std::move(own),
                distributed::Sums::from_bytes(receive(other), fmt::format("the sums of process {}", other)));
  }
  return own;
}

std::string MpiProcesses::of_first(std::string bytes) {
  int step = 1;
  while (step < count_ && rank_ % (2 * step) == 0) step *= 2;
  if (rank_ > 0) bytes = receive(rank_ - step);
  for (step /= 2; step > 0; step /= 2) {
    if (rank_ + step < count_) send(bytes, rank_ + step);
  }
  return bytes;
}

std::string MpiProcesses::cost() const {
  return fmt::format(
      "{} processes; the first one received {} bytes, and spent {:.2f} s in messages, waiting included\n", count_,
      received_, waited_.count());
}

}  // namespace llmt::apps
