#include "innerspring/mesh/team.h"

#include <gtest/gtest.h>

#include <numeric>

namespace innerspring {
namespace {

TEST(Team, RunsEveryBlockOnce) {
    for (int threads = 1; threads <= 8; ++threads) {
        Team team(threads);
        EXPECT_EQ(team.threads(), threads);
        for (std::size_t blocks : {0, 1, 2, 3, 7, 8, 9, 64, 1000}) {
            std::vector<int> calls(blocks, 0);
            team.run(blocks, [&](std::size_t block) { ++calls.at(block); });
            for (std::size_t block = 0; block < blocks; ++block)
                ASSERT_EQ(calls[block], 1) << threads << " threads, block " << block;
        }
    }
}

TEST(Team, ReturnsOnlyWhenAllIsDoneOverManyRounds) {
    Team team(3);
    std::vector<long> values(37, 0);
    for (long round = 1; round <= 3000; ++round) {
        // Every round reads what others wrote in the round before.
        const std::vector<long> before = values;
        team.run(values.size(),
                 [&](std::size_t block) { values[block] = 1 + before[(block + 5) % before.size()]; });
        ASSERT_EQ(std::accumulate(values.begin(), values.end(), 0L), long(values.size()) * round);
    }
}

TEST(Team, ComesBackFromSleep) {
    Team team(4);
    for (int round = 0; round < 5; ++round) {
        std::this_thread::sleep_for(
            std::chrono::milliseconds(20));  // long enough for the workers to stop spinning
        std::atomic<int> done{0};
        team.run(16, [&](std::size_t) { ++done; });
        ASSERT_EQ(done, 16);
    }
}

TEST(Team, StartsAndEndsWithoutWork) {
    for (int n = 0; n < 50; ++n) Team team(1 + n % 4);
    EXPECT_GE(Team(0).threads(), 1);
}

TEST(Team, BlocksCoverAllVertices) {
    EXPECT_EQ(block_count(0), 0u);
    EXPECT_EQ(block_count(1), 1u);
    EXPECT_EQ(block_count(block_size), 1u);
    EXPECT_EQ(block_count(block_size + 1), 2u);
}

TEST(Team, ThrowsOnWhatACallThrows) {
    for (int threads : {1, 2, 3}) {
        Team team(threads);
        for (int round = 0; round < 20; ++round) {
            EXPECT_THROW(team.run(10,
                                  [](std::size_t block) {
                                      if (block % 3 == 1) throw std::bad_alloc();
                                  }),
                         std::bad_alloc);
            std::atomic<int> calls{0};
            team.run(10, [&](std::size_t) { ++calls; });
            EXPECT_EQ(calls, 10);
        }
    }
}

}  // namespace
}  // namespace innerspring
