// pcl METHOD K[,K...] CLOUD CENTRES NORMALS: normals by the Point Cloud Library, for gnp-validate --peers. METHOD: pca,
// its NormalEstimation on the K nearest points; mls, its MovingLeastSquares of order 2 within the median distance of
// the K-th nearest point.
#include <algorithm>
#include <cmath>

#include <pcl/features/normal_3d.h>
#include <pcl/point_types.h>
#include <pcl/search/kdtree.h>
#include <pcl/surface/mls.h>

#include "tests/peers/peer.hpp"

using Points = pcl::PointCloud<pcl::PointXYZ>;
using Search = pcl::search::KdTree<pcl::PointXYZ>;

static pcl::IndicesPtr indices_of(const Peer &peer)
{
	return pcl::IndicesPtr(new pcl::Indices(peer.centres.begin(), peer.centres.end()));
}

static void estimate_pca(Peer &peer, const Points::Ptr &points, const Search::Ptr &search, std::size_t size)
{
	pcl::NormalEstimation<pcl::PointXYZ, pcl::Normal> estimation;
	pcl::PointCloud<pcl::Normal> normals;
	estimation.setInputCloud(points);
	estimation.setIndices(indices_of(peer));
	estimation.setSearchMethod(search);
	estimation.setKSearch(peer.sizes[size]);
	estimation.compute(normals);
	for (std::size_t i = 0; i < normals.size(); i++)
		peer_set(peer, size, i, normals[i].normal_x, normals[i].normal_y, normals[i].normal_z);
}

static double median_distance(const Peer &peer, const Points::Ptr &points, const Search::Ptr &search, int size)
{
	std::vector<float> distances, squares;
	pcl::Indices found;
	for (std::uint32_t centre : peer.centres) {
		search->nearestKSearch((*points)[centre], size, found, squares);
		distances.push_back(std::sqrt(squares.back()));
	}
	std::nth_element(distances.begin(), distances.begin() + distances.size() / 2, distances.end());
	return distances[distances.size() / 2];
}

static void estimate_mls(Peer &peer, const Points::Ptr &points, const Search::Ptr &search, std::size_t size)
{
	pcl::MovingLeastSquares<pcl::PointXYZ, pcl::PointNormal> mls;
	pcl::PointCloud<pcl::PointNormal> fitted;
	std::vector<std::size_t> row(points->size(), 0);
	for (std::size_t i = 0; i < peer.centres.size(); i++)
		row[peer.centres[i]] = i;
	mls.setInputCloud(points);
	mls.setIndices(indices_of(peer));
	mls.setSearchMethod(search);
	mls.setComputeNormals(true);
	mls.setPolynomialOrder(2);
	mls.setSearchRadius(median_distance(peer, points, search, peer.sizes[size]));
	mls.process(fitted);
	const auto &from = mls.getCorrespondingIndices()->indices; // points with too few neighbours have no row
	for (std::size_t i = 0; i < fitted.size(); i++)
		peer_set(peer, size, row[from[i]], fitted[i].normal_x, fitted[i].normal_y, fitted[i].normal_z);
}

int main(int argc, char **argv)
{
	Peer peer = peer_begin(argc, argv);
	Points::Ptr points(new Points);
	Search::Ptr search(new Search);
	for (std::size_t i = 0; i < peer.points.size(); i += 3)
		points->push_back(pcl::PointXYZ(peer.points[i], peer.points[i + 1], peer.points[i + 2]));
	search->setInputCloud(points);
	for (std::size_t size = 0; size < peer.sizes.size(); size++)
		if (peer.method == "mls")
			estimate_mls(peer, points, search, size);
		else
			estimate_pca(peer, points, search, size);
	return peer_end(peer);
}
