// cgal METHOD K[,K...] CLOUD CENTRES NORMALS: normals by CGAL, for gnp-validate --peers. METHOD: jets, what
// jet_estimate_normals does with its defaults, a jet of degree 2 fitted to the K nearest points, at the centres alone.
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Monge_via_jet_fitting.h>
#include <CGAL/Orthogonal_k_neighbor_search.h>
#include <CGAL/Search_traits_3.h>

#include "tests/peers/peer.hpp"

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using Point = Kernel::Point_3;
using Traits = CGAL::Search_traits_3<Kernel>;
using Search = CGAL::Orthogonal_k_neighbor_search<Traits>;

static void estimate(Peer &peer, const Search::Tree &tree, const std::vector<Point> &points, std::size_t size)
{
	for (std::size_t i = 0; i < peer.centres.size(); i++) {
		std::vector<Point> near;
		for (const auto &found : Search(tree, points[peer.centres[i]], peer.sizes[size]))
			near.push_back(found.first);
		CGAL::Monge_via_jet_fitting<Kernel> fitting;
		const auto normal = fitting(near.begin(), near.end(), 2, 1).normal_direction();
		peer_set(peer, size, i, normal.x(), normal.y(), normal.z());
	}
}

int main(int argc, char **argv)
{
	Peer peer = peer_begin(argc, argv);
	std::vector<Point> points;
	for (std::size_t i = 0; i < peer.points.size(); i += 3)
		points.emplace_back(peer.points[i], peer.points[i + 1], peer.points[i + 2]);
	Search::Tree tree(points.begin(), points.end());
	for (std::size_t size = 0; size < peer.sizes.size(); size++)
		estimate(peer, tree, points, size);
	return peer_end(peer);
}
