#include <gtest/gtest.h>

#include <set>

#include "innerspring/mesh/live_tree.h"
#include "innerspring/mesh/random.h"

// A tree whose items come and go finds what looking at all finds.
namespace innerspring {
namespace {

struct Items {
    std::vector<Box> boxes;
    std::vector<bool> there;
    LiveTree tree;

    auto box_of() const {
        return [this](Index i) -> const Box& { return boxes[i]; };
    }
    std::set<Index> in(const Box& box) const {
        std::set<Index> found;
        for (Index i = 0; i < boxes.size(); ++i)
            if (there[i] && overlap(boxes[i], box)) found.insert(i);
        return found;
    }
    /// Each item once in the leaf it is said to be in, boxes around all that is below them, and in no node
    /// more than in those.
    void check() const {
        std::size_t items = 0, nodes = 0;
        double leaves = 0;
        std::vector<Index> stack;
        if (!tree.nodes.empty()) stack.push_back(0);
        while (!stack.empty()) {
            const Index n = stack.back();
            stack.pop_back();
            ++nodes;
            const BoxTree::Node& node = tree.nodes[n];
            if (node.count == 0) {
                for (Index child : {node.first, node.first + 1}) {
                    ASSERT_EQ(tree.parents[child], n);
                    const Box both = join(node.box, tree.nodes[child].box);
                    ASSERT_TRUE(both.lower == node.box.lower && both.upper == node.box.upper);
                    stack.push_back(child);
                }
                continue;
            }
            ASSERT_LE(node.count, tree.room);
            const Vector s = node.box.upper - node.box.lower;
            leaves += s.x() * s.y() + s.y() * s.z() + s.z() * s.x();
            items += node.count;
            Box box = boxes[tree.items[node.first]];
            for (Index k = 0; k < node.count; ++k) {
                const Index item = tree.items[node.first + k];
                ASSERT_EQ(tree.leaf_of[item], n);
                box = join(box, boxes[item]);
            }
            ASSERT_TRUE(box.lower == node.box.lower && box.upper == node.box.upper) << "not fitted";
        }
        ASSERT_EQ(items, std::size_t(std::count(there.begin(), there.end(), true)));
        ASSERT_EQ(nodes + 2 * tree.free_pairs.size(), tree.nodes.size());
        ASSERT_NEAR(leaves, tree.leaves, 1e-9 * (1 + leaves));
    }
};

Box random_box(Random& random, double size) {
    const auto number = [&] { return random.uniform(); };
    const Vector lower(number(), number(), 0.1 * number());
    return {lower, lower + size * Vector(number(), number(), number())};
}

TEST(LiveTree, FindsWhatIsThereAfterAnyChanges) {
    for (unsigned seed = 1; seed <= 12; ++seed) {
        Random random(seed);
        const double size = seed % 3 == 0 ? 0 : 0.1;  // points too
        Items all;
        for (int n = 0; n < 200; ++n) all.boxes.push_back(random_box(random, size));
        all.there.assign(all.boxes.size(), true);
        all.tree = live_tree(build_box_tree(all.boxes), 8);
        all.check();
        for (int round = 0; round < 40; ++round) {
            // In some rounds nearly all go, or all.
            const double go = round % 20 == 19 ? 1 : round % 10 == 9 ? 0.95 : 0.1;
            for (Index i = 0; i < all.boxes.size(); ++i)
                if (all.there[i] && random.uniform() < go) {
                    take_out(all.tree, i);
                    all.there[i] = false;
                }
            // The last one takes the place of one that is gone.
            for (Index i = 0; i < all.boxes.size(); ++i) {
                const Index last = Index(all.boxes.size()) - 1;
                if (all.there[i] || i == last || random.uniform() < 0.5) continue;
                if (all.there[last]) rename(all.tree, last, i);
                all.boxes[i] = all.boxes[last], all.there[i] = all.there[last];
                all.boxes.pop_back(), all.there.pop_back(), all.tree.leaf_of.pop_back();
            }
            fit(all.tree, all.box_of());
            all.check();
            for (int n = int(30 * random.uniform()); n > 0; --n)
                all.boxes.push_back(random_box(random, size)), all.there.push_back(false),
                    all.tree.leaf_of.push_back(no_index);
            for (Index i = 0; i < all.boxes.size(); ++i)
                if (!all.there[i] && random.uniform() < 0.8) {
                    insert(all.tree, i, all.box_of());
                    all.there[i] = true;
                }
            all.check();
            const Box where = random_box(random, 0.3);
            std::set<Index> found;
            for_each_near(
                all.tree, [&](const Box& box) { return overlap(box, where); },
                [&](Index i) {
                    if (overlap(all.boxes[i], where)) {
                        EXPECT_TRUE(found.insert(i).second);
                    }
                });
            EXPECT_EQ(found, all.in(where));
        }
    }
}

// What is put in one after the other along a line, or all in one place, does not make it too deep to search
// without saying so; where items come evenly it stays good.
TEST(LiveTree, SaysWhenItDegrades) {
    std::vector<Box> boxes(8, Box{});
    boxes.push_back(
        {Vector::Constant(-1e6), Vector::Constant(1e6)});  // what the others cover is nothing to it
    LiveTree tree = live_tree(build_box_tree(boxes), 8);
    const auto box_of = [&](Index i) -> const Box& { return boxes[i]; };
    for (int n = 0; n < 5000 && !degraded(tree); ++n) {
        boxes.push_back(
            {Vector::Constant(std::ldexp(1, -n % 1000)), Vector::Constant(std::ldexp(1, -n % 1000))});
        insert(tree, Index(boxes.size()) - 1, box_of);
    }
    EXPECT_TRUE(degraded(tree));
    EXPECT_LT(tree.deepest, 110);

    Random random(1);
    boxes.clear();
    const auto point = [&] {
        const Vector x(random.uniform(), random.uniform(), 0.01 * random.uniform());
        return Box{x, x};
    };
    for (int n = 0; n < 1000; ++n) boxes.push_back(point());
    tree = live_tree(build_box_tree(boxes), 16);
    for (int n = 0; n < 4000; ++n) {
        boxes.push_back(point());
        insert(tree, Index(boxes.size()) - 1, box_of);
    }
    EXPECT_FALSE(degraded(tree));
    EXPECT_LT(tree.deepest, 25);
}

}  // namespace
}  // namespace innerspring
